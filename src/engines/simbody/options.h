// The adapter's settings, read once from assay's Settings. Valid C++17, as world.h is.
#pragma once

#include <vector>

namespace assay {
struct Setting;
struct Settings;
}  // namespace assay

namespace assay::simbody {

enum class Method { kSemiExplicitEuler, kVerlet, kRungeKutta2, kRungeKutta3, kRungeKuttaMerson, kRungeKuttaFehlberg };

// What settings() declares, typed. The meaning of each is in its declaration in options.cc.
struct Options {
  double timestep = 1e-3;  // s
  Method method = Method::kSemiExplicitEuler;
  bool native_pd = true;
  double limit_frequency = 0.2;    // rad a step
  double limit_dissipation = 0.5;  // s/rad
};

// An integrator in words.
struct MethodFacts {
  const char* name;  // as a setting's value
  Method method;
  int order;
  const char* text;
};

std::vector<Setting> declared_settings();
Options read_options(const Settings& settings);
const MethodFacts& method_facts(const Settings& settings);

}  // namespace assay::simbody
