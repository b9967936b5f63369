"""Missions: settings, starts, the simulation loop, storage, overlap and coverage."""
