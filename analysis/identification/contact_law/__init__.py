"""Wall and contact law of the impacts: which wall they show, the law on it, intervals of its parameters."""
