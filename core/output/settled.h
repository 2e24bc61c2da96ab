/* SPDX-License-Identifier: MIT */
/* settled - states in which all has come to rest, kept for the next run that would settle alike. docs/decisions/0020 */
#pragma once
#include "run.h"

/* All that the state at the end of settling depends on, as a text to free(): to be asked for after the set-up, before the
 * first step. NULL if nothing settles. */
char *quern_settled_key(const quern_run *);

/* Takes a state that another run of the same key has left in the cache, to the same bits as by settling: quern in
 * XDG_CACHE_HOME, else in ~/.cache, or the folder QUERN_CACHE, which may be none. False, and nothing is changed, if there is
 * no such state; if it cannot be read to its end, the run has stopped. */
bool quern_settled_take(quern_run *, const char *key);
/* Keeps the state at the end of settling that has begun with this key, if it was long enough to be worth it, and drops what
 * was not used for longest where there is too much. Faults go to the log: the run needs none of it. */
void quern_settled_keep(quern_run *, const char *key);
