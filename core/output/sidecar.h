/* SPDX-License-Identifier: MIT */
/* sidecar - run.xdmf and views/: small files that let ParaView and VisIt open a whole run, without a copy of the data */
#pragma once
#include <stdbool.h>
#include <stdint.h>

typedef struct quern_sidecars quern_sidecars;

/* `frames`: how many frames are there already, from 0 on; they are looked at, and the lists of them are written anew.
 * NULL with one sentence in `why` if that cannot be. Otherwise `why` is empty, or says which frames cannot be read and
 * stand in no list. */
quern_sidecars *quern_sidecars_create(const char *folder, int64_t frames, char why[256]);
void quern_sidecars_destroy(quern_sidecars *);
/* Adds a frame that was just written: the lists grow by one entry, whatever there is already, and never name a frame that
 * is not there. */
bool quern_sidecars_add(quern_sidecars *, int64_t frame, char why[256]);
