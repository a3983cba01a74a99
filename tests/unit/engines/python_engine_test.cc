#include "engines/python_engine.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "message_of.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

using testing::AllOf;
using testing::HasSubstr;

// What an adapter without contenders declares.
constexpr const char* kNothing =
    R"({"build": {"version": "1", "source": "", "compiler": "", "flags": ""}, "environment": "venv", "batches": false,
        "settings": [], "contenders": [], "capabilities": [], "files": []})";

constexpr const char* kAdapter = R"(
import assay_adapter as assay
class Engine(assay.Engine):
    environment = "venv"
    def contenders(self):
        return [assay.Contender(name="still", summary="does nothing")]
    def capabilities(self, settings):
        return assay.Capabilities()
)";

class PythonEngineTest : public TempFolderTest {
 public:
  PythonEngineTest() {
    fs::create_directories(dir_);
    if (const char* cache = std::getenv("ASSAY_CACHE")) cache_ = cache;
    ::setenv("ASSAY_CACHE", (dir_ / "cache").c_str(), 1);
  }
  ~PythonEngineTest() override {
    if (cache_) {
      ::setenv("ASSAY_CACHE", cache_->c_str(), 1);
    } else {
      ::unsetenv("ASSAY_CACHE");
    }
  }
  PythonEngineTest(const PythonEngineTest&) = delete;
  PythonEngineTest& operator=(const PythonEngineTest&) = delete;

 protected:
  std::string adapter(const std::string& text = kAdapter) const {
    const fs::path file = dir_ / "assay-engine-still.py";
    std::ofstream(file) << text;
    return file;
  }
  void environment(const std::string& version) const {
    fs::create_directories(dir_ / "venv");
    std::ofstream(dir_ / "venv/pyvenv.cfg") << "home = /opt/python/bin\n" << version << "\n";
  }
  // False where this build has no plugin for adapters in Python.
  bool has_host() const {
    keep_declaration("still", adapter(), kNothing);
    return fs::exists(dir_ / "cache/declarations");
  }

 private:
  std::optional<std::string> cache_;
};

TEST_F(PythonEngineTest, TheEnvironmentSaysWhichInterpreter) {
  const std::string path = adapter();
  for (const char* line : {"version = 3.99.1", "version_info = 3.99.1.final.0"}) {
    environment(line);
    const PythonFacts facts = python_facts(*python_engine("still", path, kNothing));
    EXPECT_EQ(facts.environment, fs::weakly_canonical(dir_ / "venv"));
    EXPECT_EQ(facts.prefix, "/opt/python");
    EXPECT_EQ(fs::path(facts.host).filename(), "assay-python-host-3.99.so");
  }
}

TEST_F(PythonEngineTest, AnInterpreterThatIsNotHereIsNamedWithTheCommand) {
  const std::string path = adapter();
  environment("version = 3.12.4");
  EXPECT_THAT(message_of<std::runtime_error>([&] { python_engine("still", path, kNothing); }),
              AllOf(HasSubstr("of Python 3.12, and assay has 3."), HasSubstr("-m venv --clear " + dir_.string())));
  environment("version = 3.99.1");
  // it is there, and no library
  const auto made = python_engine("still", path, kNothing);
  EXPECT_THAT(message_of<std::runtime_error>([&] { static_cast<void>(made->check({}, {})); }),
              AllOf(HasSubstr("engine 'still' is in Python, and"), HasSubstr("3.99.so' cannot be loaded (")));
}

TEST_F(PythonEngineTest, DeclarationsAreKeptUntilAFileChanges) {
  const std::string path = adapter(), helper = dir_ / "helper.py";
  if (!has_host()) GTEST_SKIP() << "no host of adapters in Python is built";
  std::ofstream(helper) << "one";
  std::string declared = kNothing;
  declared.replace(declared.find(R"("files": [])"), 11, fmt::format(R"("files": ["{}"])", helper));
  EXPECT_EQ(kept_declaration("other", path), "");
  keep_declaration("other", path, declared);
  EXPECT_EQ(kept_declaration("other", path), declared);
  EXPECT_EQ(kept_declaration("another", path), "");
  std::ofstream(helper) << "two";
  EXPECT_EQ(kept_declaration("other", path), "");
  keep_declaration("other", path, declared);
  EXPECT_EQ(kept_declaration("other", path), declared);
  adapter(std::string(kAdapter) + "\n");
  EXPECT_EQ(kept_declaration("other", path), "");
  adapter();
  EXPECT_EQ(kept_declaration("other", path), declared);
  for (const auto& entry : fs::directory_iterator(dir_ / "cache/declarations")) std::ofstream(entry.path()) << "{";
  EXPECT_EQ(kept_declaration("other", path), "");
}

TEST_F(PythonEngineTest, AProcessHasOneInterpreter) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "an interpreter reports its own leaks";
#else
  const std::string path = adapter();
  if (!has_host()) GTEST_SKIP() << "no host of adapters in Python is built";
  environment("version = 3.99.1");
  const auto made = python_engine("still", path, declare_in_python("still", path));  // with what is there
  // The standard library is enough to check.
  EXPECT_TRUE(made->check({}, {}).empty());
  EXPECT_THAT(message_of<std::runtime_error>([&] { static_cast<void>(made->create({}, {}, {})); }),
              testing::MatchesRegex("engine 'still' needs Python 3.99, and this process has Python 3.1[13] already: "
                                    "`assay simulate MODEL --engine still` gives it a process of its own"));
#endif
}

}  // namespace
}  // namespace assay
