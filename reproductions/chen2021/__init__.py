"""The study of Chen 2021 again: his cases, his two pipelines, and every method since."""
