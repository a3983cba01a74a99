// A contender's examination in a process of its own, which its engine may end, and certificates as text.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "check/parity/parity.h"
#include "engines/registry.h"

namespace assay::parity {

// One contender an engine, in joint coordinates where it has one: all contenders of an engine are given the same robot.
// With `all` every contender.
std::vector<ResolvedContender> contenders_for(const Model& model, bool all);

// The certificate (certificate.h) that `make` gives in a process of its own, which reads engines alone; one with a
// failure where that process ends otherwise. Empty where it was interrupted (isolate/interruption.h). Throws
// EndedFromOutside.
std::optional<nlohmann::ordered_json> examined_apart(const Model& model, const std::string& contender,
                                                     const std::string& engine,
                                                     const std::function<Certificate()>& make);

// A table of certificates, and what each says of its contender, for standard output.
std::string certificates_text(const nlohmann::ordered_json& certificates);

}  // namespace assay::parity
