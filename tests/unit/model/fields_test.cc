// model/fields.h: each member of a model's parts has a row, and the hash has every row that is physics.
#include "model/fields.h"

#include <gtest/gtest.h>

namespace assay {
namespace {

// Counts rows, and changes the one of number `at`.
class Change {
 public:
  explicit Change(int at) : at_(at) {}

  template <typename T>
  Change& operator()(const char* name, T& member) {
    if (rows_++ == at_) {
      change(member);
      changed_ = name;
      is_hashed_ = true;
    }
    return *this;
  }
  Change& list(int) { return *this; }
  template <typename Default, typename T, typename... Rows>
  void later(const Default& otherwise, const char* name, T& member, Rows&&... rows) {
    EXPECT_EQ(member, otherwise) << name << ": the default of its list is not that of the struct";
    (*this)(name, member);
    if constexpr (sizeof...(rows) > 0) later(otherwise, rows...);
  }
  template <typename T>
  void unhashed(const char* name, T& member) {
    (*this)(name, member);
    if (rows_ == at_ + 1) is_hashed_ = false;
  }

  size_t rows() const { return static_cast<size_t>(rows_); }
  const std::string& changed() const { return changed_; }
  bool is_hashed() const { return is_hashed_; }

 private:
  static void change(int& value) { ++value; }
  static void change(double& value) { value += 0.5; }
  static void change(bool& value) { value = !value; }
  static void change(std::string& value) { value += "x"; }
  static void change(Vec3& value) { value.y() += 1; }
  static void change(Quat& value) { value = Quat(0, 1, 0, 0); }
  static void change(Pose& value) { value.p.x() += 1; }
  static void change(Mat3& value) { value(0, 1) += 1; }
  static void change(ShapeType& value) { value = ShapeType::kCapsule; }
  static void change(JointType& value) { value = JointType::kSlide; }
  static void change(std::array<float, 4>& value) { value[0] += 0.25f; }
  template <typename T>
  static void change(std::vector<T>& value) {
    value.emplace_back();
  }

  int at_, rows_ = 0;
  std::string changed_;
  bool is_hashed_ = false;
};

template <typename Part>
void expect_complete(std::vector<Part> Model::* parts) {
  Model model;
  (model.*parts).emplace_back();
  Change count(-1);
  fields(count, (model.*parts)[0]);
  EXPECT_EQ(count.rows(), member_count<Part>()) << "a member without a row";
  const std::string hash = model_hash(model);
  for (int row = 0; row < static_cast<int>(count.rows()); ++row) {
    Model other = model;
    Change change(row);
    fields(change, (other.*parts)[0]);
    EXPECT_EQ(model_hash(other) != hash, change.is_hashed()) << change.changed();
  }
}

TEST(ModelFields, EveryMemberHasARowAndPhysicsIsInTheHash) {
  expect_complete(&Model::bodies);
  expect_complete(&Model::joints);
  expect_complete(&Model::balls);
  expect_complete(&Model::shapes);
  expect_complete(&Model::hulls);
  expect_complete(&Model::height_fields);
  expect_complete(&Model::contacts);
  expect_complete(&Model::couplings);
  expect_complete(&Model::connects);
  expect_complete(&Model::welds);
  expect_complete(&Model::tendons);
}

}  // namespace
}  // namespace assay
