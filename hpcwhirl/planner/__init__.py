"""The planner: which jobs of a campaign are left, given the jobs that have ended.

A `Job` is one computation of a case or of one of its twins, to its planned end time or
to a later one of an extension. `Planner` returns the jobs left after some have ended,
and the jobs that follow from each further one that ends; it reads no file and knows no
rank. The set of jobs does not depend on the order in which they end, and a job that has
ended is never returned again. The run, `status`, `--dry-run` and gathering all use it.

Parts of a planner:

- a kind of design (`kinds`), which says which cases there are, and which have twins:
  `Grid`, all cases known beforehand (grids, zips, lists, samples);
  `Chains`, branches, each case of which follows another one; `Refined`, cases that
  follow from words; `Folds`, branches with further cases where the word changes.
  Another kind of design needs another class in `kinds`.
- stages: an extended campaign (`--extend undecided --to S`) has a stage for each end
  time, for cases whose regime is still open. The record of each stage has a digest of
  its own; a decided case has no further stage.
- twins: the twins of a case become jobs after the case has ended with a result, if the
  kind requests them; each twin has stages like any case.
"""
