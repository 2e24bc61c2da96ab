/* SPDX-License-Identifier: MIT */
#include "environment.h"
#include <fcntl.h>
#include <fenv.h>
#include <stdint.h>
#include <sys/stat.h>
#include <unistd.h>

enum { FLAGS = 63 }; /* the low six bits of MXCSR are raised by arithmetic, the others change its results */

unsigned quern_arithmetic(void) {
	uint16_t x87;
	__asm__ volatile("fnstcw %0" : "=m"(x87));
	return (__builtin_ia32_stmxcsr() & ~(unsigned)FLAGS) | (unsigned)x87 << 16;
}

void quern_arithmetic_set(unsigned mode) {
	const uint16_t x87 = (uint16_t)(mode >> 16);
	feclearexcept(FE_ALL_EXCEPT); /* an exception that is pending would strike as soon as it is unmasked */
	__asm__ volatile("fldcw %0" : : "m"(x87));
	__builtin_ia32_ldmxcsr(mode & 0xffffu & ~(unsigned)FLAGS);
}

static unsigned open_streams(void) {
	unsigned bits = 0;
	for (int fd = 0; fd < 3; fd++)
		if (fcntl(fd, F_GETFD) >= 0) bits |= 1u << fd;
	return bits;
}

quern_environment quern_environment_take(void) {
	quern_environment e = { .arithmetic = quern_arithmetic(),
		.open = open_streams(),
		.folder = open(".", O_PATH | O_DIRECTORY | O_CLOEXEC) };
	struct stat is;
	if (e.folder >= 0 && !fstat(e.folder, &is)) e.device = is.st_dev, e.inode = is.st_ino;
	return e;
}

static int folder_moved(const quern_environment *e) {
	struct stat is;
	return e->folder >= 0 && (stat(".", &is) || is.st_dev != e->device || is.st_ino != e->inode);
}

const char *quern_environment_restore(quern_environment *e) {
	const char *changed = NULL;
	const unsigned now = open_streams();
	if (e->open & ~now) changed = "what is open for reading and printing";
	e->open = now; /* said once: what is closed cannot be opened again */
	if (folder_moved(e) && !fchdir(e->folder)) changed = "the working folder";
	if (quern_arithmetic() == e->arithmetic) return changed;
	quern_arithmetic_set(e->arithmetic);
	return "the rounding or another mode of arithmetic";
}

void quern_environment_drop(quern_environment *e) {
	if (e->folder >= 0) close(e->folder);
	e->folder = -1;
}
