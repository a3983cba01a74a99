// An answer in parts (results/answer.h) as text for people.
#pragma once

#include "results/answer.h"

namespace assay {

void print(const Answer& answer);
void print_markdown(const Answer& answer);

}  // namespace assay
