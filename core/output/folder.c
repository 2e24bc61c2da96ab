/* SPDX-License-Identifier: MIT */
#include "folder.h"
#include "text.h"
#include <errno.h>
#include <stdlib.h>
#include <sys/stat.h>

bool quern_folder_make(const char *path) {
	char *copy = quern_copy(path);
	bool good = *path != 0;
	for (char *p = copy + 1; good; p++)
		if (*p == '/' || !*p) {
			const char kept = *p;
			*p = 0;
			good = !mkdir(copy, 0777) || errno == EEXIST;
			*p = kept;
			if (!kept) break;
		}
	const int why = errno;
	free(copy);
	errno = why;
	return good;
}
