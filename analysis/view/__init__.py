"""What `ovines view` shows: geometry of the bodies (`outlines`), and its writing as a rerun recording (`stream`)."""
