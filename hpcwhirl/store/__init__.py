"""Files of a campaign: journals and traces while it runs, `results.h5` when it is done.

Its subpackages: `directory`, a campaign's directory while the campaign runs;
`results`, writing of `results.h5`; `reading`, reading of results; `models`, files of
engines and wheels. All of them may use the modules directly in `store`.

A campaign's directory holds the following files. Their format number is `format` in
`campaign.json`; `results.h5` has a format number of its own. Unknown formats are
refused.

campaign.json
    the plan: inputs, axes of the swept inputs (or every case with its digest), and
    `format`. It begins with the SHA-256 of the rest, so that an edited file is
    refused; it is replaced as a whole.
journal/RUN-RANK.log
    a header that lists the fields of the records (`directory.record`), then one
    record of fixed size with CRC-32 for each finished case; appended and synced in
    groups, at most a second apart. The record of an extended case or of a twin has a
    digest of its own; its field `of` is the digest of the planned case.
traces/RUN-RANK.bin
    raw little-endian float64, one block for each case, synced before its record, which
    holds offset, number of bytes, CRC-32 and shapes.
states/DIGEST.state
    saved state of an unfinished case: a line of JSON with its CRC-32, then raw bytes;
    replaced as a whole, and removed when the case has ended. With `keep_states`, the
    state of an undecided case at its last row of evidence stays, so that a longer run
    can continue from it. A state that is damaged, or belongs to another model, kernel
    or compiler, is dropped, and one line says so.
running/RUN-RANK.log
    the case that a rank computes now, and since when; a file left behind means that a
    process died.
owners/
    one file for each process that computes or gathers here, removed when it ends. One
    run computes in a directory at a time (shards I/N with the same N share it); a
    second run is refused, and the message names the first. The claim of a dead process
    is taken over: on its own machine at once, from another machine 2 minutes after its
    last sign of life. Gathering and `classify` wait for each other.
runs/RUN.json
    how each rank used its time, and why the run stopped early; missing after a kill.
results.h5
    written under a new temporary name `results.h5.*.part` each time, synced and
    renamed; `runs/results.stamp` holds its size and time.

No file is written by two runs. A record is dropped if it is incomplete, if its checksum
is wrong, or if its block of traces is incomplete: an interrupted write costs one group
at most. The newest complete record of a case counts. The CRC detects accidents: an
interrupted write, a flipped bit, a truncated copy. It is no signature: anyone who may
write in the directory can add rows that were never computed, and they are gathered;
only the permissions of the file system prevent that.

`results.h5` is netCDF-4 (HDF5) and follows CF-1.11 (64-bit integers need 1.9), as
`compliance-checker` confirms (`pytest tests/store/test_cf.py`). Its dimension is
`case`; every variable has a unit and a long name (`scene.quantities`). Words are
integers with `flag_values` and `flag_meanings` (`scene.words`); a reader uses those of
the file, so that files of versions with other words are read correctly. Swept inputs
are variables named by `scene.quantities.variable_name`, such as `casing_thickness`.
Version, scene, command, preset and its accuracy loss, hosts and libraries are
attributes. Traces have the dimensions (`case`, `time`, ...). The group `twins` holds
the rows of each case's twins, from which `classify` determines their words and shares
again. The group `performance` holds computing time, rank and host of each case and,
over `worker`, how each rank used its time (`busy_fraction`, `worker_*`). Everything
outside this group is equal bit for bit for any number of ranks and after any kill and
resume.

The serial and the MPI-IO writer share their code and differ in how they open the file.
Gathering keeps 24 to 48 bytes for each case and 32 MB of traces (those of at least one
case) in memory. HDF5 writes much of a file while closing it, and if that fails it
crashes at the end of the process; so files are flushed first, and errors of a full disk
are kept from the library. Free space is checked before gathering, since MPI-IO waits
for ever if the write of one rank fails. Compressed traces through MPI-IO need HDF5
1.10.2 or newer.

`engine_file` reads an engine's HDF5 file, `sparse_file` the matrices of finite elements
that `import-model` turns into one, `wheel_file` the description of their unknowns. They
read and check arrays; mechanics is in other packages.
"""
