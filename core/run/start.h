/* SPDX-License-Identifier: MIT */
/* start - a scene that starts from another run's state: sections whose solver says so take their sets from its file.
 * docs/decisions/0029 */
#pragma once
#include "run.h"

/* Opens what the scene's sections start from, so that its hash, its state and its copy are of one moment: a run that is
 * still at work replaces its checkpoint. What cannot be opened is said when it is read. */
void quern_start_hold(quern_run *);
void quern_start_let_go(quern_run *);
/* Where a file that the scene names is read: `path`, or what is held of it. malloc'ed. */
char *quern_start_held(const quern_run *, const char *path);
/* Before the set-up: what the scene's sections name. A fault is the scene's, QUERN_E_PARAM. */
quern_status quern_start_read(quern_run *);
/* Behind the set-up: sets whose entries point at what the set-up has made. */
quern_status quern_start_read_rest(quern_run *);
/* quern_host.taken */
bool quern_start_took(quern_run *, const char *field);
