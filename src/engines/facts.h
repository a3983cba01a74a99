// What is known of contenders and models, as JSON and as words.
#pragma once

#include <string>

#include "base/console.h"
#include "engines/registry.h"
#include "model/model.h"

namespace assay {

std::string fidelity_text(Fidelity fidelity);  // "exact", "approximated", "refused"

// Settings with unit, range and meaning, capabilities, where the engine comes from and how it was built.
Json contender_json(const ResolvedContender& contender);

// Sizes of a model; `name` is what `assay` calls it.
Json model_json(const std::string& name, const Model& model);

// What the file has and the model has not: a line for each note on standard error.
void tell_notes(const Model& model);

}  // namespace assay
