/* checkpoint - all state of a run in one file, from which it goes on to the same bits */
#pragma once
#include "run.h"

/* Writes DIR/checkpoint.h5, or leaves the old one; QUERN_E_IO with run->message on a fault. `rows`: of series.csv. */
quern_status quern_checkpoint_write(quern_run *, int64_t rows);

/* Puts the state back. QUERN_E_IO if the file is missing, damaged or of another scene, with one sentence in `why`;
 * the run must then not be used. */
quern_status quern_checkpoint_read(quern_run *, const char *path, int64_t *rows, char why[256]);

/* What must agree for a resume: the resolved scene without the keys that may change. */
uint64_t quern_checkpoint_key(const quern_scene *);
