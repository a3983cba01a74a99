// A model as the text from which assay_adapter.py makes it again, with the names of model.h.
#pragma once

#include <string>

#include "model/model.h"

namespace assay::python {

std::string model_json(const Model& model);

}  // namespace assay::python
