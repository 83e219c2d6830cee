"""What Python users hold: a study that is run or loaded, asked, drawn, reported and planned."""
