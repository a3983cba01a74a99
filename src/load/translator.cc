#include "load/translator.h"

#include <algorithm>
#include <span>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/spec_text.h"

namespace assay {

Vec3 vec3(const mjtNum* array, int index) {
  const mjtNum* v = row(array, 3, index);
  return {v[0], v[1], v[2]};
}

Quat quat(const mjtNum* array, int index) {
  const mjtNum* q = row(array, 4, index);
  return Quat(q[0], q[1], q[2], q[3]).normalized();
}

bool all_zero(const mjtNum* values, int count) {
  return std::ranges::all_of(std::span(values, count), [](mjtNum value) { return value == 0; });
}

LoadReport translate(const TranslationInput& input) { return Translator(input).translate(); }

Translator::Translator(const TranslationInput& input)
    : m_(input.compiled),
      load_(input.load),
      base_is_link_(input.base_is_link),
      starts_mimics_(input.starts_mimics || input.base_is_link),
      base_floats_(input.base_floats),
      massless_(input.massless),
      inertia_(input.inertia),
      facts_(input.facts),
      drawing_(input.drawing) {
  read_places(input);
  for (int i = 0; i < m_->nbody; ++i) body_names_.insert(name(mjOBJ_BODY, i));
  for (int i = 0; i < m_->njnt; ++i) joint_names_.insert(name(mjOBJ_JOINT, i));
  for (int i = 0; i < m_->ngeom; ++i) shape_names_.insert(name(mjOBJ_GEOM, i));
  for (int i = 0; i < m_->neq; ++i) equality_names_.insert(name(mjOBJ_EQUALITY, i));
}

LoadReport Translator::translate() {
  refuse_foreign_elements();
  translate_options();
  translate_bodies();
  if (!model_.bodies.empty()) {
    translate_shapes();
    translate_contacts();
    translate_tendons();
    translate_equalities();
    translate_actuators();
    translate_sines();
    translate_keyframes();
    note_mocap_bodies();
    note_list("concave meshes are several convex hulls (--decompose)", decomposed_);
    note_list("bounds of ranges are swapped, which MuJoCo reads as no limits (--repair swaps them back)", swapped_);
    note_list(
        "softness of limits, friction and constraints (solref, solimp, solmix, gap) is ignored, because the contender "
        "decides it",
        softened_);
    require_finite();
    if (facts_ != nullptr) {
      fill_places(*facts_);
      for (int g = 0; g < m_->ngeom && !contacts_disabled(); ++g) {
        if (shape_of_[g] >= 0 && !may_collide(g)) facts_->drawn.insert(model_.shapes[shape_of_[g]].name);
      }
    }
    if (drawing_ != nullptr) translate_drawing(*drawing_);
  }
  LoadReport report;
  report.problems = std::move(problems_);
  std::ranges::stable_sort(report.problems, {}, &Problem::line);
  if (!report.refused()) report.model = std::move(model_);
  return report;
}

// ---- places and labels for messages ---------------------------------------------------------------------------------

void Translator::read_places(const TranslationInput& input) {
  const mjSpec* spec = input.spec;
  const auto note = [&](mjtObj type, auto as) {
    for (mjsElement* e = mjs_firstElement(spec, type); e != nullptr; e = mjs_nextElement(spec, e)) {
      FilePlace& own = places_[{type, mjs_getId(e)}];
      own.line = spec_line(as(e)->info);  // 0 in included files
      const std::string origin = own.line > 0 ? spec_origin(spec, e) : "";
      if (!origin.empty()) own.file = input.file_of_model(origin);
    }
  };
  note(mjOBJ_BODY, mjs_asBody);
  note(mjOBJ_JOINT, mjs_asJoint);
  note(mjOBJ_GEOM, mjs_asGeom);
  note(mjOBJ_MESH, mjs_asMesh);
  note(mjOBJ_PAIR, mjs_asPair);
  note(mjOBJ_EQUALITY, mjs_asEquality);
  note(mjOBJ_TENDON, mjs_asTendon);
  note(mjOBJ_ACTUATOR, mjs_asActuator);
  note(mjOBJ_FLEX, mjs_asFlex);
  note(mjOBJ_NUMERIC, mjs_asNumeric);
  note(mjOBJ_KEY, mjs_asKey);
}

Translator::FilePlace Translator::place(mjtObj type, int id) const {
  const auto found = places_.find({type, id});
  if (found != places_.end() && found->second.line > 0) return found->second;
  if (type == mjOBJ_JOINT) return place(mjOBJ_BODY, m_->jnt_bodyid[id]);
  if (type == mjOBJ_GEOM) return place(mjOBJ_BODY, m_->geom_bodyid[id]);
  return {};
}

std::string Translator::name(mjtObj type, int id) const {
  const char* text = mj_id2name(m_, type, id);
  return text == nullptr ? "" : text;
}

std::string Translator::label(mjtObj type, int id) const {
  const char* kind = mju_type2Str(type);
  if (const std::string own = name(type, id); !own.empty()) return fmt::format("{} '{}'", kind, own);
  if (type == mjOBJ_JOINT) {
    const int body = m_->jnt_bodyid[id];
    if (m_->body_jntnum[body] == 1) return fmt::format("the joint of {}", label(mjOBJ_BODY, body));
    return fmt::format("joint {} of {}", id - m_->body_jntadr[body] + 1, label(mjOBJ_BODY, body));
  }
  if (type == mjOBJ_GEOM) {
    const int body = m_->geom_bodyid[id];
    return fmt::format("geom {} of {}", id - m_->body_geomadr[body] + 1, label(mjOBJ_BODY, body));
  }
  return fmt::format("{} number {}", kind, type == mjOBJ_BODY ? id : id + 1);
}

void Translator::add_problem(Problem problem) {
  if (problem.severity == Severity::kLeftOut) note(problem_text(problem));
  problems_.push_back(std::move(problem));
}

void Translator::refuse(mjtObj type, int id, const std::string& what, const std::string& mend) {
  const auto [line, file] = place(type, id);
  add_problem({.element = label(type, id), .line = line, .file = file, .message = what, .mend = mend});
}

void Translator::refuse(const std::string& what, const std::string& mend) {
  add_problem({.message = what, .mend = mend});
}

void Translator::unsupported(mjtObj type, int id, const std::string& what, const std::string& mend,
                             const std::string& drop) {
  const auto [line, file] = place(type, id);
  Problem problem = {.element = label(type, id), .line = line, .file = file, .message = what, .mend = mend};
  problem.option = load_.drop_unsupported ? "" : fmt::format("--drop-unsupported, which {}", drop);
  if (load_.drop_unsupported) {
    problem.severity = Severity::kLeftOut;
    problem.message = fmt::format("{}: --drop-unsupported {}", what, drop);
  }
  add_problem(std::move(problem));
}

void Translator::unsupported(const std::string& what, const std::string& mend, const std::string& drop) {
  Problem problem = {.message = what, .mend = mend};
  problem.option = load_.drop_unsupported ? "" : fmt::format("--drop-unsupported, which {}", drop);
  if (load_.drop_unsupported) {
    problem.severity = Severity::kLeftOut;
    problem.message = fmt::format("{}: --drop-unsupported {}", what, drop);
  }
  add_problem(std::move(problem));
}

void Translator::note_list(const std::string& what, const std::vector<std::string>& elements) {
  constexpr size_t kNamed = 12;
  if (elements.empty()) return;
  std::vector<std::string> named(elements.begin(),
                                 elements.begin() + static_cast<std::ptrdiff_t>(std::min(kNamed, elements.size())));
  const size_t more = elements.size() - named.size();
  note(fmt::format("{}: {}{}", what, join(named, ", "), more > 0 ? fmt::format(" and {} more", more) : ""));
}

void Translator::soften(const std::string& element) {
  if (std::ranges::find(softened_, element) == softened_.end()) softened_.push_back(element);
}

bool Translator::has_own_softness(const mjtNum* solref, const mjtNum* solimp) {
  constexpr std::array<mjtNum, mjNREF> kRef = {0.02, 1};
  constexpr std::array<mjtNum, mjNIMP> kImp = {0.9, 0.95, 0.001, 0.5, 2};
  return !std::ranges::equal(kRef, std::span(solref, mjNREF)) || !std::ranges::equal(kImp, std::span(solimp, mjNIMP));
}

std::string Translator::unique_name(const std::string& own, const std::string& fallback, std::set<std::string>& taken) {
  if (!own.empty()) return own;
  std::string result = fallback;
  for (int i = 2; !taken.insert(result).second; ++i) result = fmt::format("{}_{}", fallback, i);
  return result;
}

}  // namespace assay
