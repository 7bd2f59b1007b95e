"""The Baxter chapter: the thesis's experiment reproduced, then surpassed, with the evidence."""
