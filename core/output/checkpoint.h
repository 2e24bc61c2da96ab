/* SPDX-License-Identifier: MIT */
/* checkpoint - all state of a run in one file, from which it goes on to the same bits */
#pragma once
#include "identity.h"

/* Writes DIR/checkpoint.h5, or leaves the old one. On a fault run->message: QUERN_E_IO, or QUERN_E_NUMERIC if the state
 * holds what no run could go on from. `rows`: of series.csv. Takes as much memory as the file. */
quern_status quern_checkpoint_write(quern_run *, int64_t rows);

/* Puts the state back, and the clock to what the scene asks for now. `force`: with other plugins than those that wrote
 * it; they are noted in run->replaced. `said`: what has changed since, a line each. QUERN_E_IO if the file is missing,
 * damaged, or of another scene or of other plugins, with one sentence in `why`; the run must then not be used. Takes no
 * memory but the state's. */
quern_status quern_checkpoint_read(
	quern_run *, const char *path, bool force, int64_t *rows, quern_text *said, quern_text *why);
