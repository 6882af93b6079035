"""Images of bakes: their files, facts about them, and storing results in them."""
