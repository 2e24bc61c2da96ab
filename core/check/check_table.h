/* SPDX-License-Identifier: MIT */
/* quern_check_table - rows of parameters and uses, wherever a table holds them */
#pragma once
#include "check.h"

void quern_check_parameter_rows(const check *, quern_check_tally *, const quern_param *);
void quern_check_use_rows(const check *, quern_check_tally *, const quern_use *);
