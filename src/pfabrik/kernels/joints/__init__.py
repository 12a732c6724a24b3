"""All joint coordinates: closing loops, and descending along closed loops to the nearest feasible configuration."""
