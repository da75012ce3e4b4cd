"""One formula in the place of names.

Parts of a cause that nobody has listed may have the form of listed effects: the drag of a fan's wind has a constant
part, which is a tilt's, and one that goes with the speed, which is a viscous drag's.  Names are tried first, and a law
is then sought beside them, of a cause that is whole without them.  So where a law stands beside names, the formula is
sought once more with the names out of the model, among those that are no name's own form.

And a single name may take nearly the whole of such a cause: the mean of a wall that softens at one side is a drift, and
what it leaves is too faint for chance to be ruled out.  So names that leave nothing are held against the dictionary,
too, and give way to a formula that says clearly more of runs held out."""
