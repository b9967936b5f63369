"""One HTML file that shows a run, a data set, a benchmark or a study."""
