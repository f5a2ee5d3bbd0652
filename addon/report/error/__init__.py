"""Error against run time: what each method gets wrong on a scene, and what being right costs."""
