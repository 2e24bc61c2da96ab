/* settled - states in which grains have come to rest, kept for the next run that would settle alike. docs/decisions/0020 */
#pragma once
#include "run.h"

/* The folder that they lie in, to free(): QUERN_CACHE, else quern in XDG_CACHE_HOME, else in ~/.cache. NULL where QUERN_CACHE
 * is empty, or no home is known: then nothing is kept. */
char *quern_settled_folder(void);

/* After the set-up: takes a state that another run of the same beginning has left, to the same bits as by settling. False,
 * and nothing is changed, if there is none; if it cannot be read to its end, the run has stopped. */
bool quern_settled_take(quern_run *);
/* Keeps the state at the end of settling, if settling was long enough to be worth it, and drops what was not used for
 * longest where there is too much. Faults go to the log: the run needs none of it. */
void quern_settled_keep(quern_run *);
