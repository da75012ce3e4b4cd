"""How far: errors on runs held out of every fit, shrinkage, detectable sizes."""
