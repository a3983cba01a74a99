#include "check/pairing/match.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "check/pairing/align.h"
#include "model/joint.h"
#include "model/kinematics.h"

namespace assay::pairing {
namespace {

// The words of a name without those that say what it names: "panda_joint_1" -> "panda 1".
std::string core_of(const std::string& name) {
  std::vector<std::string> words(1);
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_word = std::isalnum(byte) != 0;
    const bool was_digit = !words.back().empty() && std::isdigit(static_cast<unsigned char>(words.back().back())) != 0;
    const bool new_number = is_word && !words.back().empty() && was_digit != (std::isdigit(byte) != 0);
    if ((!is_word || new_number) && !words.back().empty()) words.emplace_back();
    if (is_word) words.back() += static_cast<char>(std::tolower(byte));
  }
  std::erase_if(words, [](const std::string& word) {
    return word.empty() || word == "joint" || word == "link" || word == "body" || word == "jnt";
  });
  return join(words, " ");
}

// Where the bodies and the lines of their joints are at 0.
struct Layout {
  explicit Layout(const Model& model)
      : X_WB(model.bodies.size()), p(X_WB.size()), axis(X_WB.size()), carried(X_WB.size(), 1) {
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Body& body = model.bodies[i];
      X_WB[i] = body.parent == kWorld ? body.X_PB : X_WB[static_cast<size_t>(body.parent)] * body.X_PB;
      p[i] = X_WB[i] * anchor_of(model, body);
      axis[i] = body.joint >= 0 ? Vec3(X_WB[i].q * model.joints[body.joint].axis_B) : Vec3(Vec3::Zero());
      size = std::max(size, (p[i] - p[0]).norm());
    }
    for (size_t i = model.bodies.size(); i-- > 0;) {
      if (model.bodies[i].parent != kWorld) carried[static_cast<size_t>(model.bodies[i].parent)] += carried[i];
    }
  }
  std::vector<Pose> X_WB;
  std::vector<Vec3> p, axis;
  std::vector<int> carried;  // bodies, itself included
  double size = 0.05;        // m
};

class Matcher {
 public:
  Matcher(const Model& a, const Model& b) : a_(a), b_(b), lay_a_(a), lay_b_(b) {
    b_of_.assign(a.bodies.size(), -1), a_of_.assign(b.bodies.size(), -1);
    how_.assign(a.bodies.size(), How::kName);
  }

  std::vector<BodyMatch> result(const std::vector<std::pair<std::string, std::string>>& map) {
    for (const auto& [name_a, name_b] : map) {
      const int i = find(a_, name_a), j = find(b_, name_b);
      if (i >= 0 && j >= 0) mapped(i, j, name_a, name_b);
    }
    by_name([](const Model& model, int body) { return name_of(model, body); });
    by_name([](const Model& model, int body) { return model.bodies[static_cast<size_t>(body)].name; });
    by_name([](const Model& model, int body) { return core_of(name_of(model, body)); });
    by_name([](const Model& model, int body) { return core_of(model.bodies[static_cast<size_t>(body)].name); });
    respect_trees();
    align();
    leave_misleading_names();
    by_kinematics();
    respect_trees();
    std::vector<BodyMatch> matches;
    for (size_t i = 0; i < b_of_.size(); ++i) {
      if (b_of_[i] >= 0) matches.push_back({static_cast<int>(i), b_of_[i], how_[i]});
    }
    return matches;
  }

 private:
  static int find(const Model& model, const std::string& name) {
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      if (name_of(model, static_cast<int>(i)) == name) return static_cast<int>(i);
    }
    const auto found = std::ranges::find(model.bodies, name, &Body::name);
    return found == model.bodies.end() ? -1 : static_cast<int>(found - model.bodies.begin());
  }

  JointType type_a(int i) const { return joint_type(a_, a_.bodies[static_cast<size_t>(i)]); }
  JointType type_b(int j) const { return joint_type(b_, b_.bodies[static_cast<size_t>(j)]); }

  void set(int i, int j, How how) {
    b_of_[static_cast<size_t>(i)] = j, a_of_[static_cast<size_t>(j)] = i;
    how_[static_cast<size_t>(i)] = how;
  }

  void mapped(int i, int j, const std::string& name_a, const std::string& name_b) {
    if (type_a(i) != type_b(j)) {
      throw InputError(
          fmt::format("--map {}={}: {} of the first file and {} of the second are of different types; map "
                      "joints of one type",
                      name_a, name_b, element_of(a_, i), element_of(b_, j)));
    }
    if (b_of_[static_cast<size_t>(i)] >= 0 || a_of_[static_cast<size_t>(j)] >= 0) {
      throw InputError(
          fmt::format("--map {}={} names an element that another --map has; name each once", name_a, name_b));
    }
    set(i, j, How::kMap);
  }

  template <typename Name>
  void by_name(const Name& name) {
    std::map<std::string, std::vector<int>> of_a, of_b;
    for (size_t i = 0; i < b_of_.size(); ++i) {
      if (b_of_[i] < 0) of_a[name(a_, static_cast<int>(i))].push_back(static_cast<int>(i));
    }
    for (size_t j = 0; j < a_of_.size(); ++j) {
      if (a_of_[j] < 0) of_b[name(b_, static_cast<int>(j))].push_back(static_cast<int>(j));
    }
    for (const auto& [text, list] : of_a) {
      const auto found = of_b.find(text);
      if (text.empty() || list.size() != 1 || found == of_b.end() || found->second.size() != 1) continue;
      if (type_a(list[0]) == type_b(found->second[0])) set(list[0], found->second[0], How::kName);
    }
  }

  // The nearest matched body that carries it.
  int carrier_a(int i) const {
    do i = a_.bodies[static_cast<size_t>(i)].parent;
    while (i != kWorld && b_of_[static_cast<size_t>(i)] < 0);
    return i;
  }
  int carrier_b(int j) const {
    do j = b_.bodies[static_cast<size_t>(j)].parent;
    while (j != kWorld && a_of_[static_cast<size_t>(j)] < 0);
    return j;
  }

  // Takes back a match that hangs on a body other than its match does. Those that a user gave stay as long as others
  // can go.
  void respect_trees() {
    const auto wrong = [&](size_t i) {
      const int carrier = carrier_a(static_cast<int>(i));
      return carrier_b(b_of_[i]) != (carrier == kWorld ? kWorld : b_of_[static_cast<size_t>(carrier)]);
    };
    for (const bool also_given : {false, true}) {
      for (bool again = true; again;) {
        again = false;
        for (size_t i = 0; i < b_of_.size(); ++i) {
          if (b_of_[i] < 0 || (how_[i] == How::kMap && !also_given) || !wrong(i)) continue;
          a_of_[static_cast<size_t>(b_of_[i])] = -1, b_of_[i] = -1;
          again = true;
        }
      }
    }
  }

  // Names can be those of other joints (numbers that begin elsewhere): where more joints coincide without names, where
  // they lie counts.
  void leave_misleading_names() {
    const auto coinciding = [&] {
      size_t count = 0;
      for (size_t i = 0; i < b_of_.size(); ++i) {
        if (b_of_[i] >= 0 && line_cost(i, static_cast<size_t>(b_of_[i]), world_) < 0.05) ++count;
      }
      return count;
    };
    const auto named = static_cast<size_t>(std::ranges::count_if(b_of_, [](int j) { return j >= 0; }));
    const size_t right = coinciding();
    if (right == named) return;
    const auto before = std::tuple(b_of_, a_of_, how_);
    for (size_t i = 0; i < b_of_.size(); ++i) {
      if (b_of_[i] < 0 || how_[i] == How::kMap) continue;
      a_of_[static_cast<size_t>(b_of_[i])] = -1, b_of_[i] = -1;
    }
    by_kinematics();
    if (coinciding() <= right) std::tie(b_of_, a_of_, how_) = before;
  }

  // B's world in A's: the way that brings the most joints of B to a joint of A.
  void align() {
    std::vector<Pose> ways = {{}};
    std::vector<Vec3> from, to;
    for (size_t i = 0; i < b_of_.size(); ++i) {
      if (b_of_[i] < 0) continue;
      const auto j = static_cast<size_t>(b_of_[i]);
      ways.push_back(lay_a_.X_WB[i] * lay_b_.X_WB[j].inverse());
      from.push_back(lay_b_.p[j]), to.push_back(lay_a_.p[i]);
      if (ways.size() > 6) break;
    }
    if (const auto fit = best_fit(from, to)) ways.push_back(*fit);
    // roots on each other: their frames, their first joints, or what their lines and the next joints span
    const std::vector<size_t> roots_a = roots(a_), roots_b = roots(b_);
    for (const size_t i : roots_a) {
      for (const size_t j : roots_b) {
        const Pose frames = lay_a_.X_WB[i] * lay_b_.X_WB[j].inverse();
        ways.push_back(frames);
        ways.push_back({lay_a_.p[i] - lay_b_.p[j], Quat::Identity()});
        ways.push_back({lay_a_.p[i] - frames.q * lay_b_.p[j], frames.q});
        const std::optional<Pose> of_a = span(a_, lay_a_, i, 1);
        for (const double sign : {1.0, -1.0}) {
          const std::optional<Pose> of_b = span(b_, lay_b_, j, sign);
          if (of_a && of_b) ways.push_back(*of_a * of_b->inverse());
        }
      }
    }
    int most = -1;
    for (const Pose& way : ways) {
      int near = 0;
      for (size_t j = 0; j < a_of_.size(); ++j) {
        for (size_t i = 0; i < b_of_.size(); ++i) {
          if (line_cost(i, j, way) < 0.05) {
            ++near;
            break;
          }
        }
      }
      if (near > most) most = near, world_ = way;
    }
  }

  // The largest trees' roots.
  static std::vector<size_t> roots(const Model& model) {
    constexpr size_t kMost = 8;
    const Layout lay(model);
    std::vector<size_t> list;
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      if (model.bodies[i].parent == kWorld) list.push_back(i);
    }
    std::ranges::stable_sort(list, std::greater<>(), [&](size_t i) { return lay.carried[i]; });
    if (list.size() > kMost) list.resize(kMost);
    return list;
  }

  // A frame that does not depend on what a file calls a body's: at the joint, along its axis and towards the next joint
  // or the centre of mass.
  static std::optional<Pose> span(const Model& model, const Layout& lay, size_t i, double sign) {
    constexpr double kLeast = 1e-3;  // m
    if (lay.axis[i].norm() == 0) return std::nullopt;
    const Vec3 axis = sign * lay.axis[i].normalized();
    std::vector<Vec3> points;
    for (size_t k = 0; k < model.bodies.size(); ++k) {
      if (model.bodies[k].parent == static_cast<int>(i)) points.push_back(lay.p[k]);
    }
    points.push_back(lay.X_WB[i] * model.bodies[i].p_BBcm);
    for (const Vec3& point : points) {
      Vec3 across = point - lay.p[i];
      across -= axis * axis.dot(across);
      if (across.norm() < kLeast) continue;
      across.normalize();
      Mat3 R;
      R << axis, across, axis.cross(across);
      return Pose{lay.p[i], Quat(R)};
    }
    return std::nullopt;
  }

  // 0 for the same line, 1 for one that is 30 degrees or a quarter of the robot's size away.
  double line_cost(size_t i, size_t j, const Pose& way) const {
    if (type_a(static_cast<int>(i)) != type_b(static_cast<int>(j))) return 10;
    const Vec3 apart = way * lay_b_.p[j] - lay_a_.p[i], axis = way.q * lay_b_.axis[j];
    double angle = 0;
    double distance = apart.norm();
    if (lay_a_.axis[i].norm() > 0) {
      angle = std::atan2(axis.cross(lay_a_.axis[i]).norm(), std::abs(axis.dot(lay_a_.axis[i])));
      // along the line a joint may be put anywhere
      const Vec3 along = lay_a_.axis[i] * lay_a_.axis[i].dot(apart);
      distance = (apart - along).norm() + 0.2 * along.norm();
    }
    if (type_a(static_cast<int>(i)) == JointType::kFree) distance *= 0.3;
    return angle / (M_PI / 6) + distance / (0.25 * std::max(lay_a_.size, lay_b_.size));
  }

  double cost(size_t i, size_t j) const {
    double sum = line_cost(i, j, world_);
    const double of_a = lay_a_.carried[i], of_b = lay_b_.carried[j];
    sum += 0.3 * (1 - std::min(of_a, of_b) / std::max(of_a, of_b));
    const double mass_a = a_.bodies[i].mass, mass_b = b_.bodies[j].mass;
    if (mass_a > 0 && mass_b > 0) sum += 0.1 * std::min(1.0, std::abs(std::log(mass_a / mass_b)));
    const auto name_a = core_of(name_of(a_, static_cast<int>(i))), name_b = core_of(name_of(b_, static_cast<int>(j)));
    if (name_a != name_b) sum += 0.02;
    return sum;
  }

  void by_kinematics() {
    // children of one carrier with each other, then also what an unmatched body lies between
    for (const bool through : {false, true}) {
      for (bool again = true; again;) {
        again = false;
        std::vector<std::tuple<double, size_t, size_t>> ways;
        for (size_t i = 0; i < b_of_.size(); ++i) {
          if (b_of_[i] >= 0) continue;
          const int carrier = carrier_a(static_cast<int>(i));
          if (!through && carrier != a_.bodies[i].parent) continue;
          for (size_t j = 0; j < a_of_.size(); ++j) {
            if (a_of_[j] >= 0 || (!through && carrier_b(static_cast<int>(j)) != b_.bodies[j].parent)) continue;
            if (carrier_b(static_cast<int>(j)) != (carrier == kWorld ? kWorld : b_of_[static_cast<size_t>(carrier)]))
              continue;
            const double c = cost(i, j);
            if (c < (through ? 0.3 : 1.5)) ways.emplace_back(c, i, j);
          }
        }
        std::ranges::sort(ways);
        if (!ways.empty()) {
          // one at a time on each carrier: what it carries is judged with it
          for (const auto& [c, i, j] : ways) {
            if (b_of_[i] >= 0 || a_of_[j] >= 0) continue;
            set(static_cast<int>(i), static_cast<int>(j), c < 0.4 ? How::kKinematics : How::kStructure);
            again = true;
            if (through) break;
          }
        }
      }
    }
  }

  const Model& a_;
  const Model& b_;
  Layout lay_a_, lay_b_;
  std::vector<int> b_of_, a_of_;
  std::vector<How> how_;
  Pose world_;
};

}  // namespace

const char* how_text(How how) {
  switch (how) {
    case How::kMap:
      return "map";
    case How::kName:
      return "name";
    case How::kKinematics:
      return "kinematics";
    case How::kStructure:
      return "structure";
  }
  return "";
}

std::string name_of(const Model& model, int body) {
  const Body& b = model.bodies[static_cast<size_t>(body)];
  return b.is_free() ? b.name : joint_name(model, b);
}

std::string element_of(const Model& model, int body) {
  const Body& b = model.bodies[static_cast<size_t>(body)];
  const char* noun = b.is_free() ? "free body" : b.ball >= 0 ? "ball joint" : "joint";
  return fmt::format("{} '{}'", noun, name_of(model, body));
}

std::vector<BodyMatch> match_bodies(const Model& a, const Model& b,
                                    const std::vector<std::pair<std::string, std::string>>& map) {
  return Matcher(a, b).result(map);
}

}  // namespace assay::pairing
