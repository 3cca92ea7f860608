"""The planner: the jobs left in a campaign, from the completions so far.

A `Job` is one computation of a case or of one of its twins, as planned or at a later
stage of an extension. `Planner` returns the jobs left after some completions, and the
jobs that follow from each further one; it reads no file and knows no rank. The set of
jobs does not depend on the order of completions, and a job that has ended is never
asked for again. The run, `status`, `--dry-run` and gathering all ask it.

Parts of a planner:

- a kind (`kinds`): the cases, and those of them with twins, by completions: `Grid`, all
  cases known beforehand (grids, zips, lists, samples); `Refined`, cases that follow
  from regimes. Another kind of design is another class there.
- stages: an extended campaign (`--extend undecided --to S`) has one for each end time,
  for cases whose regime is still open. Their records have digests of their own; a
  case that is decided stays as it is.
- twins: follow after their case has ended with a result, if the kind requests them;
  each has stages like any case.
"""
