// One translation of MuJoCo's compiled model into the neutral Model, cut into the files translate_*.cc. Each step reads
// what the former ones filled in. A problem never ends a step: it goes on as if the part were left out, so that all
// problems are found.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "load/translation.h"

namespace assay {

// ---- MuJoCo's arrays ------------------------------------------------------------------------------------------------

// They hold rows of `width` values.
template <typename T, typename Index>
T* row(T* array, std::ptrdiff_t width, Index index) {
  return array + width * static_cast<std::ptrdiff_t>(index);
}
Vec3 vec3(const mjtNum* array, int index = 0);
Quat quat(const mjtNum* array, int index = 0);
bool all_zero(const mjtNum* values, int count);

class Translator {
 public:
  explicit Translator(const TranslationInput& input);
  LoadReport translate();

 private:
  // ---- translator.cc: places and labels for messages
  struct FilePlace {
    int line = 0;           // 0 when unknown
    std::string file = {};  // of a model that is an asset; empty for the model's own
  };
  void read_places(const TranslationInput& input);
  FilePlace place(mjtObj type, int id) const;
  std::string name(mjtObj type, int id) const;
  // "joint 'knee'", "geom 2 of body 'foot'", "tendon number 2": enough for the user to find the element.
  std::string label(mjtObj type, int id) const;
  void refuse(mjtObj type, int id, const std::string& what, const std::string& mend);
  void refuse(const std::string& what, const std::string& mend);
  // Refused unless --drop-unsupported is given. `drop` says what the switch then does: "keeps the linear part alone".
  void unsupported(mjtObj type, int id, const std::string& what, const std::string& mend, const std::string& drop);
  void unsupported(const std::string& what, const std::string& mend, const std::string& drop);
  void add_problem(Problem problem);
  void note(std::string text) { model_.notes.push_back(std::move(text)); }
  // One note for all elements of a kind, at most a few of them by name.
  void note_list(const std::string& what, const std::vector<std::string>& elements);
  // An element whose own softness the contender replaces.
  void soften(const std::string& element);
  static bool has_own_softness(const mjtNum* solref, const mjtNum* solimp);
  bool disabled(int flag) const { return (m_->opt.disableflags & flag) != 0; }
  // The file's own name if it has one (MuJoCo keeps names unique), else `fallback`, made unique by an appended number.
  static std::string unique_name(const std::string& own, const std::string& fallback, std::set<std::string>& taken);

  // ---- translate_options.cc: what belongs to the file as a whole
  void refuse_foreign_elements();
  void translate_options();

  // ---- translate_bodies.cc
  void translate_bodies();
  bool is_mocap(int b) const { return m_->body_mocapid[b] >= 0; }
  Pose pose_in_parent(int b) const;
  Pose mocap_pose(int b, int keyframe) const;
  void note_mocap_bodies();
  void freeze_points_of_flexes();
  void freeze_weightless_leaves();
  void add_moving_body(int b, const Pose& X_MpB);
  bool is_plain_free(int j) const;
  void add_sprung_free_body(int b, int j, const Pose& X_WB);
  int add_body(Body body, int b, int j, int weld_parent, int coordinate = 0);
  void add_joint(int j, Body& body);
  void examine_joint(int j);
  void require_mass();
  void require_sound_chains();
  bool chain_is_singular(const std::vector<int>& chain) const;
  bool limited(int j) const { return m_->jnt_limited[j] && !disabled(mjDSBL_LIMIT) && !disabled(mjDSBL_CONSTRAINT); }
  bool has_dry_friction() const { return !disabled(mjDSBL_FRICTIONLOSS) && !disabled(mjDSBL_CONSTRAINT); }
  // The range that MuJoCo's limit holds: its margin keeps the coordinate that much inside.
  std::pair<double, double> narrowed(mjtObj type, int id, const mjtNum* range, double margin);
  // What a coordinate of MuJoCo's joint `j` has beside its place: spring, damper, armature, dry friction.
  template <typename AnyJoint>
  void translate_passive(int j, AnyJoint& joint) const;
  void translate_scalar(int j, Joint& joint) const;
  void translate_ball(int j, BallJoint& ball);

  // ---- translate_shapes.cc
  void translate_shapes();
  bool contacts_disabled() const { return disabled(mjDSBL_CONTACT) || disabled(mjDSBL_CONSTRAINT); }
  bool may_collide(int g) const;
  void add_shape(int g, int body);
  std::array<float, 4> colour_of(int g) const;
  bool fill_shape(int g, Shape& shape);
  const std::vector<int>& hulls_of_mesh(int g);
  std::optional<Hull> hull_of(int g, int mesh);
  std::vector<Hull> parts_of(int g, int mesh, const Hull& whole);
  int height_field(int h);

  // ---- translate_drawing.cc
  void translate_drawing(Drawing& drawing);

  // ---- translate_contacts.cc
  void translate_contacts();
  bool passes_filter(int g1, int g2) const;
  void add_filtered_pair(int g1, int g2);
  void add_explicit_pair(int p);
  void examine_contact_extras(int g);
  void examine_surface_velocity(int g);
  void add_contact(int g1, int g2, int condim, const Vec3& friction);

  // ---- translate_constraints.cc: equality and fixed tendons
  void translate_tendons();
  void translate_equalities();
  void translate_joint_equality(int e);
  void translate_tendon_equality(int e);
  void translate_body_equality(int e);
  void couple(int e, const std::vector<JointTerm>& zero_sum, double sum);
  std::string equality_name(int e);
  // Terms of a fixed tendon; nothing when one of its joints does not move.
  std::optional<std::vector<JointTerm>> tendon_terms(int tendon) const;

  // ---- translate_actuators.cc
  void translate_actuators();
  bool actuator_group_disabled(int i) const;
  bool acts_on(int i, Actuator& actuator);
  bool has_supported_law(int i, Actuator& actuator);
  void fold_inertia_and_damping(int i, const Actuator& actuator);
  void fold_force_limits();
  void fold_force_limit(mjtObj type, int id, const mjtNum* range, const std::vector<std::pair<size_t, double>>& acting);
  void translate_sines();

  // ---- translate_states.cc
  void translate_keyframes();
  std::string keyframe_name(int k) const;
  State keyframe_state(int k) const;
  State state_at(const mjtNum* qpos, const mjtNum* qvel) const;
  // The keyframe that the run starts in: none where the file has none, or not the one that is asked for.
  std::optional<int> initial_keyframe() const;
  void choose_initial_state();
  void start_mimics();
  void note_open_constraints();
  void require_finite();

  // ---- translate_facts.cc
  void fill_places(FileFacts& facts) const;

  const mjModel* m_;
  LoadOptions load_;
  bool base_is_link_, starts_mimics_, base_floats_;
  bool has_sprung_free_ = false;  // free joints as three slides and a ball
  std::set<std::string> massless_;
  std::map<std::string, RigidPart> inertia_;
  FileFacts* facts_;
  Drawing* drawing_;
  Model model_;
  std::vector<Problem> problems_;

  std::map<std::pair<int, int>, FilePlace> places_;  // (object type, id) -> where it is
  std::vector<bool> frozen_;                         // by MuJoCo body: its joints are left out
  std::vector<int> body_of_;                         // MuJoCo body -> index into Model::bodies, kWorld when static
  std::vector<Pose> X_MB_;                           // MuJoCo body's frame in that body (or the world)
  std::vector<int> weld_parent_;    // Model body -> Model body of the MuJoCo parent (chains are one body there)
  std::vector<int> joint_of_;       // Model body -> MuJoCo joint
  std::vector<int> coordinate_of_;  // Model body -> its first coordinate in that joint: 0, or 0 to 3 of a free joint
  std::vector<int> body_of_joint_;  // MuJoCo joint -> Model body, -1 when left out
  std::vector<int> mujoco_body_;    // Model body -> MuJoCo body
  std::vector<int> shape_of_;       // MuJoCo geom -> index into Model::shapes, -1 when left out
  std::vector<int> parts_;          // MuJoCo geom -> how many shapes it is, beginning there
  std::map<int, std::vector<int>> hulls_of_;  // MuJoCo mesh -> indices into Model::hulls
  std::map<int, int> height_field_of_;        // MuJoCo height field -> index into Model::height_fields
  std::vector<int> actuator_of_;              // Model actuator -> MuJoCo actuator
  std::vector<double> inflation_;             // Model shape -> contact margin that its size contains, m
  std::set<std::string> body_names_, joint_names_, shape_names_, equality_names_;  // taken
  std::vector<std::string> odd_margins_;       // pairs whose margin is replaced by their geoms'
  std::vector<std::string> swapped_;           // joints without limits, because their bounds are swapped
  std::vector<std::string> softened_;          // elements whose own softness is ignored
  std::vector<std::string> decomposed_;        // meshes that are several hulls
  std::vector<std::array<bool, 3>> examined_;  // by geom: what of it was examined already (translate_contacts.cc)
  std::set<int> excluded_;                     // pairs of bodies as MuJoCo signs them
};

}  // namespace assay
