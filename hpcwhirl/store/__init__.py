"""Files: journals and traces while a campaign runs, `results.h5` when it is done.

Its rooms: `directory`, a campaign's directory while it runs; `results`, how
`results.h5` is written; `reading`, what either tells; `models`, files of engines and
wheels. Any of them may use what lies here.

What a campaign's directory holds; `format` in `campaign.json` holds for all of it but
`results.h5`, which has one of its own, and an unknown one is refused:

campaign.json
    the plan: inputs, axes of what is swept or every case and its digest, `format`.
    Begins with the SHA-256 of the rest: an edited one is refused. Replaced whole.
journal/RUN-RANK.log
    a record per finished case, of fixed size, with its CRC-32, behind a header that
    tells its fields (`directory.record`); appended and synced in groups, at most a
    second apart. One of a case that went on, or of a twin, has a digest of its own and
    names that of the case it is `of`.
traces/RUN-RANK.bin
    raw little-endian float64, one block a case, synced before its record, which tells
    offset, bytes, CRC-32 and shapes.
states/DIGEST.state
    a case on its way: a line of JSON with its CRC-32, then raw bytes; replaced whole,
    gone when the case has ended, unless it is undecided and `keep_states` is wanted:
    then the state at its last row of evidence stays, from which a longer run goes on.
    One that is damaged, or of another model, kernel or compiler, is dropped with one
    line.
running/RUN-RANK.log
    what a rank computes now and since when; a file left over means that a process died.
owners/
    who computes or gathers here; gone when it has ended. One run computes in a
    directory at a time (shards of one division share it), a second one is refused by
    name. A dead owner is taken over, on its machine at once, on another 2 minutes after
    its last sign of life. Gathers and `classify` wait for each other.
runs/RUN.json
    what each rank did with its time, and why it stopped early; missing after a kill.
results.h5
    gathered under `results.h5.*.part`, a name of its own each time, synced and renamed;
    `runs/results.stamp` has its size and time.

No file is written by two runs. A record that is not whole or has another checksum is
dropped, so is one whose block is not all there: a torn tail costs its group at most.
The newest whole record of a case counts. The CRC is for accidents: a torn write, a
flipped bit, a copy cut short. It is no signature: who may write in the directory can
add rows that were never computed, and they are gathered; rights of the file system keep
others out, nothing else does.

`results.h5` is netCDF-4 (HDF5), CF-1.11 (from 1.9 CF knows integers of 64 bits), as
`compliance-checker` finds it (`pytest tests/store/test_cf.py`): dimension `case`, units
and long names on every variable (`scene.quantities`), words as integers with
`flag_values` and `flag_meanings` (`scene.words`), by which files are read, so that one
of a version with other words is read rightly; swept inputs under their own name or with
their table's (`casing_thickness`); version, scene, command, preset and what it loses,
hosts and libraries as attributes. Traces over (`case`, `time`, ...). The group `twins`
has the rows of each case's twins, by which `classify` gives their words and shares
anew. The group `performance` has seconds, rank and host of each case and, over
`worker`, what each rank did with its time (`busy_fraction`, `worker_*`). All but this
group is the same bit for bit for any number of ranks and after any kill and resume.

The serial and the MPI-IO writer are one code under two ways to open a file. Gathering
keeps 24 to 48 bytes a case and 32 MB of traces (at least one case's) in memory. HDF5
writes much of a file as it is closed, and where that fails it crashes as the process
ends: files are flushed first, and the library never sees a full disk. Before gathering,
the room is checked: MPI-IO waits for ever where one rank's write fails. Traces
packed through MPI-IO need HDF5 1.10.2 or newer.

An engine's HDF5 file is read in `engine_file`, which knows arrays and no mechanics;
matrices of finite elements, from which `import-model` makes one, in `sparse_file`, what
their unknowns are in `wheel_file`.
"""
