/* SPDX-License-Identifier: MIT */
/* child - work that may crash, hang, end the program or multiply, done by a process of its own
 *
 * The child has a session of its own, which ends with it, and limits: time, memory, open files, the size of files. It
 * cannot start a process; it dies of the attempt. What it finds out goes through memory that both see. */
#pragma once
#include <stdbool.h>
#include <stddef.h>

typedef enum {
	QUERN_CHILD_DONE,
	QUERN_CHILD_CRASHED,
	QUERN_CHILD_LATE,  /* it took too long and was ended */
	QUERN_CHILD_ENDED, /* it left before the work was done */
	QUERN_CHILD_FORKED,
	QUERN_CHILD_NONE /* there could be no child; errno says why */
} quern_child_end;

typedef struct quern_child {
	quern_child_end end;
	int signal; /* of a crash */
} quern_child;

/* Does work(arg) in a child and waits for it, `seconds` at most. What is printed is flushed on both sides. */
quern_child quern_child_run(void (*work)(void *), void *arg, unsigned seconds);
/* "crashed (SIGSEGV)", "did not come back within 3 s": what befell it, for a sentence that goes on with "in ...". */
void quern_child_say(const quern_child *, unsigned seconds, char out[80]);
const char *quern_signal_name(int number);

/* Whether this process is such a child, which may have none of its own. */
bool quern_child_is_one(void);

/* Zeroed memory that a child and its parent both see; NULL if there is none. */
void *quern_shared_take(size_t bytes);
void quern_shared_drop(void *, size_t bytes);
