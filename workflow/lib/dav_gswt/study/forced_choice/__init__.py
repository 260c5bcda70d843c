"""Which of two crops has the less visible seam? A study for people, as a kit, and what follows from answers."""
