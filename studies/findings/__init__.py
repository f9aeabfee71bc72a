"""How learned policies work and where they lose: measurements, figures and the report."""
