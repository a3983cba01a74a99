// --decompose: several hulls for a concave mesh, and what happens without CoACD.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "base/paths.h"
#include "load/mjcf.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

// A U of three bars, 0.3 x 0.3 x 0.1 m, that a ball could rest in; its hull fills the gap.
const std::string kU =
    "<mujoco><asset><mesh name='u' vertex='0 0 0  .3 0 0  .3 .3 0  .2 .3 0  .2 .1 0  .1 .1 0  .1 .3 0  0 .3 0 "
    "0 0 .1  .3 0 .1  .3 .3 .1  .2 .3 .1  .2 .1 .1  .1 .1 .1  .1 .3 .1  0 .3 .1' "
    "face='5 4 1  5 1 0  4 3 2  4 2 1  7 6 5  7 5 0  13 9 12  13 8 9  12 10 11  12 9 10  15 13 14  15 8 13 "
    "0 1 9  0 9 8  1 2 10  1 10 9  2 3 11  2 11 10  3 4 12  3 12 11  4 5 13  4 13 12  5 6 14  5 14 13  6 7 15  6 15 14 "
    "7 0 8  7 8 15'/></asset><worldbody><body name='cup'><freejoint/><geom name='u' type='mesh' mesh='u'/></body>"
    "<body name='ball' pos='.15 .2 .05'><freejoint/><geom name='ball' size='.04'/></body></worldbody></mujoco>";

class Decomposition : public TempFolderTest {
 protected:
  Decomposition() : libraries_(fs::path(cache_dir()) / "libraries") {
    const char* own = std::getenv("ASSAY_CACHE");
    before_ = own == nullptr ? "" : own;
    fs::create_directories(dir_);
    ::setenv("ASSAY_CACHE", dir_.c_str(), 1);
  }
  void TearDown() override {
    if (before_.empty()) {
      ::unsetenv("ASSAY_CACHE");
    } else {
      ::setenv("ASSAY_CACHE", before_.c_str(), 1);
    }
  }
  bool link_library() const {
    if (!fs::exists(libraries_)) return false;
    fs::create_directory_symlink(libraries_, dir_ / "libraries");
    return true;
  }

  fs::path libraries_;
  std::string before_;
};

double volume(const Hull& hull) {
  double sum = 0;
  for (const auto& [a, b, c] : hull.faces) sum += hull.vertices[a].dot(hull.vertices[b].cross(hull.vertices[c])) / 6;
  return sum;
}

TEST_F(Decomposition, ConcaveMeshIsSeveralHulls) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizers do not allow a library to keep its own runtime";
#endif
  if (!link_library()) GTEST_SKIP() << "CoACD is not there";
  const Model one = load_model_text(kU, "u");
  ASSERT_EQ(one.hulls.size(), 1U);
  EXPECT_NEAR(volume(one.hulls[0]), 0.3 * 0.3 * 0.1, 1e-6);
  const Model several = load_model_text(kU, "u", {.decompose = true});
  ASSERT_GE(several.hulls.size(), 3U);
  double sum = 0;
  for (const Hull& hull : several.hulls) sum += volume(hull);
  EXPECT_NEAR(sum, 0.007, 0.1 * 0.007);  // the gap stays open
  EXPECT_EQ(several.shapes.size(), several.hulls.size() + 1);
  EXPECT_EQ(several.contacts.size(), several.hulls.size());  // each part against the ball, none against another
  EXPECT_THAT(several.notes, Contains(AllOf(HasSubstr("mesh 'u'"), HasSubstr("--decompose"))));
  EXPECT_DOUBLE_EQ(several.total_mass(), one.total_mass());
  // kept: the library is not needed again, and a file that is damaged is made again
  fs::remove(dir_ / "libraries");
  EXPECT_EQ(load_model_text(kU, "u", {.decompose = true}).hash, several.hash);
  for (const auto& entry : fs::directory_iterator(dir_ / "hulls")) std::ofstream(entry.path()) << "damaged";
  EXPECT_THROW(load_model_text(kU, "u", {.decompose = true}), InputError);
}

TEST_F(Decomposition, WithoutTheLibrary) {
  try {
    load_model_text(kU, "u", {.decompose = true});
    ADD_FAILURE() << "there is no library";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("geom 'u'"), HasSubstr("cannot be decomposed"), HasSubstr("setup/setup.sh"),
                      HasSubstr("--drop-unsupported, which keeps its one hull")));
  }
  EXPECT_EQ(load_model_text(kU, "u", {.drop_unsupported = true, .decompose = true}).hulls.size(), 1U);
}

}  // namespace
}  // namespace assay
