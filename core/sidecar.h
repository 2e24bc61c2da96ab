/* sidecar - run.xdmf and views/: small files that let ParaView and VisIt open a whole run, without a copy of the data */
#pragma once
#include <stdbool.h>
#include <stdint.h>

typedef struct quern_sidecars quern_sidecars;

/* `frames`: how many frames are there already, from 0 on; they are looked at. */
quern_sidecars *quern_sidecars_create(const char *folder, int64_t frames);
void quern_sidecars_destroy(quern_sidecars *);
/* Takes note of a frame that was just written, and rewrites the files; they never name a frame that is not there. */
bool quern_sidecars_add(quern_sidecars *, int64_t frame, char why[256]);
