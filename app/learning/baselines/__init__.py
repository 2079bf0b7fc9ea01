"""What others do from the same demonstrations: max-margin planning, maximum entropy, Bayesian IRL, copying a tool, chance."""
