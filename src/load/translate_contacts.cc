// MuJoCo's collision filter, written out as pairs with their combined friction.
#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "load/translator.h"

namespace assay {
namespace {

// What is examined once a geom, which may have many partners.
enum : int { kExtras, kSurface, kNoMass };

}  // namespace

void Translator::translate_contacts() {
  examined_.assign(static_cast<size_t>(m_->ngeom), {});
  excluded_ = std::set<int>(m_->exclude_signature, m_->exclude_signature + m_->nexclude);
  if (contacts_disabled()) {
    note("contacts are off: the file disables them");
    return;
  }
  std::map<std::pair<int, int>, int> seen;  // explicit pairs override the filter
  for (int p = 0; p < m_->npair; ++p) {
    const int a = shape_of_[m_->pair_geom1[p]], b = shape_of_[m_->pair_geom2[p]];
    if (a < 0 || b < 0) continue;  // left out with a message
    if (const auto [first, added] = seen.emplace(std::minmax(a, b), p); !added) {
      // two equal contacts hold what one holds
      const std::span mine(row(m_->pair_friction, 5, p), 5), theirs(row(m_->pair_friction, 5, first->second), 5);
      if (m_->pair_dim[p] == m_->pair_dim[first->second] && std::ranges::equal(mine, theirs)) continue;
      refuse(mjOBJ_PAIR, p, "names two geoms that another pair names too, with another friction",
             "remove one of the two");
      continue;
    }
    if (model_.shapes[a].body == model_.shapes[b].body) continue;  // rigidly joined: no force acts
    add_explicit_pair(p);
  }
  std::vector<int> active;
  for (int g = 0; g < m_->ngeom; ++g) {
    if (shape_of_[g] >= 0 && (m_->geom_contype[g] != 0 || m_->geom_conaffinity[g] != 0)) active.push_back(g);
  }
  for (size_t i = 0; i < active.size(); ++i) {
    for (size_t k = i + 1; k < active.size(); ++k) {
      const int g1 = active[i], g2 = active[k];
      if (!passes_filter(g1, g2) || seen.contains(std::minmax(shape_of_[g1], shape_of_[g2]))) continue;
      add_filtered_pair(g1, g2);
    }
  }
  std::ranges::sort(model_.contacts, {}, [](const ContactPair& pair) { return std::pair(pair.shape_a, pair.shape_b); });

  std::vector<std::string> inflated, not_inflated;
  for (int g = 0; g < m_->ngeom; ++g) {
    if (shape_of_[g] < 0 || m_->geom_margin[g] == 0 || !model_.shapes[shape_of_[g]].collides) continue;
    const std::string element = fmt::format("{} ({} m)", label(mjOBJ_GEOM, g), shortest(m_->geom_margin[g]));
    (inflation_[shape_of_[g]] != 0 ? inflated : not_inflated).push_back(element);
  }
  note_list("contact margins inflate their shapes, as in MuJoCo, except that edges of boxes and cylinders stay sharp",
            inflated);
  note_list("contact margins of pairs differ from those of their geoms, which act: the contacts come that much earlier",
            odd_margins_);
  note_list("contact margins of meshes are left out: their contacts act that much later", not_inflated);
}

bool Translator::passes_filter(int g1, int g2) const {
  const bool bits =
      (m_->geom_contype[g1] & m_->geom_conaffinity[g2]) != 0 || (m_->geom_contype[g2] & m_->geom_conaffinity[g1]) != 0;
  if (!bits) return false;
  const int b1 = m_->geom_bodyid[g1], b2 = m_->geom_bodyid[g2];
  const int a = body_of_[b1], b = body_of_[b2];
  if (a == b) return false;
  // parent and child do not collide, except with what is fixed to the world
  const bool joined = (a != kWorld && weld_parent_[a] == b) || (b != kWorld && weld_parent_[b] == a);
  const bool with_plane = m_->geom_type[g1] == mjGEOM_PLANE || m_->geom_type[g2] == mjGEOM_PLANE;
  const bool links = (a != kWorld && b != kWorld) || (base_is_link_ && !with_plane);
  if (joined && links && !disabled(mjDSBL_FILTERPARENT)) return false;
  const int signature = (std::min(b1, b2) << 16) + std::max(b1, b2);
  return !excluded_.contains(signature);
}

void Translator::add_filtered_pair(int g1, int g2) {
  const int p1 = m_->geom_priority[g1], p2 = m_->geom_priority[g2];
  int condim = std::max(m_->geom_condim[g1], m_->geom_condim[g2]);
  Vec3 friction = vec3(m_->geom_friction, g1).cwiseMax(vec3(m_->geom_friction, g2));
  if (p1 != p2) {
    const int winner = p1 > p2 ? g1 : g2;
    condim = m_->geom_condim[winner];
    friction = vec3(m_->geom_friction, winner);
  }
  for (const int g : {g1, g2}) examine_contact_extras(g);
  add_contact(g1, g2, condim, friction);
}

void Translator::add_explicit_pair(int p) {
  const int g1 = m_->pair_geom1[p], g2 = m_->pair_geom2[p];
  const mjtNum* friction = row(m_->pair_friction, 5, p);
  const int condim = m_->pair_dim[p];
  const bool directed = (condim >= 3 && friction[0] != friction[1]) || (condim >= 6 && friction[3] != friction[4]);
  if (directed) {
    unsupported(mjOBJ_PAIR, p, "has a friction that depends on the direction, which is not supported",
                "make both equal", "takes the mean of both directions");
  }
  // a pair's margin replaces those of its geoms
  const double margin = m_->pair_margin[p];
  const double inflation = inflation_[shape_of_[g1]] + inflation_[shape_of_[g2]];
  constexpr double kSmall = 0.002;  // m
  if (const double less = std::abs(margin - inflation); less > 1e-12 && less <= kSmall) {
    odd_margins_.push_back(fmt::format("{} ({} m)", label(mjOBJ_PAIR, p), shortest(inflation - margin)));
  } else if (less > kSmall) {
    unsupported(mjOBJ_PAIR, p,
                fmt::format("has a contact margin of {} m, and its geoms' margins add up to {} m", shortest(margin),
                            shortest(inflation)),
                "give the geoms the margin instead", "takes the geoms' margins");
  }
  if (m_->pair_adhesion[p] != 0) {
    unsupported(mjOBJ_PAIR, p, "has adhesion, which is not supported", "remove it", "leaves the adhesion out");
  }
  for (const int g : {g1, g2}) examine_surface_velocity(g);
  if (has_own_softness(row(m_->pair_solref, mjNREF, p), row(m_->pair_solimp, mjNIMP, p)) || m_->pair_gap[p] != 0 ||
      !all_zero(row(m_->pair_solreffriction, mjNREF, p), mjNREF)) {
    soften(label(mjOBJ_PAIR, p));
  }
  const auto mean = [](double a, double b) { return a == b ? a : (a + b) / 2; };
  add_contact(g1, g2, condim, {mean(friction[0], friction[1]), friction[2], mean(friction[3], friction[4])});
}

void Translator::examine_surface_velocity(int g) {
  if (all_zero(row(m_->geom_surfacevel, 6, g), 6) || std::exchange(examined_[g][kSurface], true)) return;
  unsupported(mjOBJ_GEOM, g, "has a surface velocity, which is not supported", "remove surfacevel",
              "lets its surface rest");
}

void Translator::examine_contact_extras(int g) {
  if (std::exchange(examined_[g][kExtras], true)) return;
  if (m_->geom_adhesion[g] != 0) {
    unsupported(mjOBJ_GEOM, g, "has adhesion, which is not supported", "remove it", "leaves the adhesion out");
  }
  examine_surface_velocity(g);
  if (has_own_softness(row(m_->geom_solref, mjNREF, g), row(m_->geom_solimp, mjNIMP, g)) || m_->geom_solmix[g] != 1 ||
      m_->geom_gap[g] != 0) {
    soften(label(mjOBJ_GEOM, g));
  }
}

// `friction`: Coulomb, torsional, rolling.
void Translator::add_contact(int g1, int g2, int condim, const Vec3& friction) {
  const auto [a, b] = std::minmax(shape_of_[g1], shape_of_[g2]);
  for (const int g : {g1, g2}) {
    const int body = model_.shapes[shape_of_[g]].body;
    if (body == kWorld || !model_.bodies[body].is_massless()) continue;
    if (!std::exchange(examined_[g][kNoMass], true)) {
      unsupported(mjOBJ_GEOM, g,
                  fmt::format("can touch others, and its body '{}' has no mass", model_.bodies[body].name),
                  R"(give the body an <inertial>, or the geom contype="0" conaffinity="0")", "leaves its contacts out");
    }
    return;
  }
  ContactPair pair = {.shape_a = a, .shape_b = b, .friction = condim == 1 ? 0 : friction[0]};
  if (condim >= 4) pair.torsional = friction[1];
  if (condim >= 6) pair.rolling = friction[2];
  // a decomposed mesh is several shapes in a row
  const auto [first, second] = shape_of_[g1] == a ? std::pair(g1, g2) : std::pair(g2, g1);
  for (pair.shape_a = a; pair.shape_a < a + parts_[first]; ++pair.shape_a) {
    for (pair.shape_b = b; pair.shape_b < b + parts_[second]; ++pair.shape_b) {
      model_.shapes[pair.shape_a].collides = model_.shapes[pair.shape_b].collides = true;
      model_.contacts.push_back(pair);
    }
  }
}

}  // namespace assay
