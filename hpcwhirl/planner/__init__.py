"""The planner: the jobs left in a campaign, from the completions so far.

A `Job` is one computation of a case or of one of its twins, as planned or at a later
stage of an extension. `Planner` returns the jobs left after some completions, and the
jobs that follow from each further completion; it reads no file and knows no rank. The
set of jobs does not depend on the order of completions, and a job that has ended is
never returned again. The run, `status`, `--dry-run` and gathering all use the planner.

Parts of a planner:

- a kind (`kinds`), which gives the cases, and those that have twins, from completions:
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
