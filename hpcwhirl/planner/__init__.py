"""What is left to do of a campaign, decided here alone, from what has ended.

A `Job` is one computation: of a case, or of one of its twins, as planned or at a later
stage of an extension. `Planner` returns the jobs that are left after some completions,
and what follows from each further one; it reads no file and knows no rank. The set of
jobs does not depend on the order of completions, and a job that has ended is never
asked for again. The run, `status`, `--dry-run` and gathering all ask it.

What a planner is made of, each on its own:

- a kind (`kinds`): which cases there are, and which of them have twins, by how cases
  end: `Grid`, cases all known beforehand (grids, zips, lists, samples); `Refined`,
  cases that follow from words. Another kind of design is another class there.
- stages: an extended campaign (`--extend undecided --to S`) has one for each time that
  it was extended to, each for cases that a longer run may decide. Their records stand
  in the journals under digests of their own; a case that is decided stays as it is.
- twins: follow when their case has ended with a result and its kind asks for them;
  each has stages like any case.
"""
