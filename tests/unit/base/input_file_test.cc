// Files of users that are none, have no end, or are too large.
#include "base/input_file.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <sys/resource.h>
#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "temp_folder.h"

namespace assay {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class InputFileTest : public TempFolderTest {
 protected:
  static constexpr std::uintmax_t kMost = 1 << 20;

  InputFileTest() { std::filesystem::create_directories(dir_); }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(dir_ / name, std::ios::binary) << text;
    return (dir_ / name).string();
  }

  static std::string refusal(const std::string& path) {
    try {
      static_cast<void>(input_text(path, "the list", "a text file", kMost));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(InputFileTest, AFileIsReadAsItIs) {
  EXPECT_EQ(input_file(write("a", std::string("x\0y\r\n", 5)), "the list", "a text file", kMost),
            std::string("x\0y\r\n", 5));
  EXPECT_EQ(input_text(write("empty", ""), "the list", "a text file", kMost), "");
  EXPECT_EQ(input_text(write("largest", std::string(kMost, 'x')), "the list", "a text file", kMost).size(), kMost);
}

TEST_F(InputFileTest, WhatIsNoFileIsNotRead) {
  EXPECT_THAT(refusal("/nowhere"), AllOf(HasSubstr("the list '/nowhere' cannot be read"), HasSubstr("No such file")));
  EXPECT_THAT(refusal("/dev/zero"), HasSubstr("is a device and not a regular file: give a text file"));
  EXPECT_THAT(refusal(dir_.string()), HasSubstr("and not a regular file"));
  const std::string pipe = (dir_ / "pipe").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(refusal(pipe), HasSubstr("and not a regular file"));
  EXPECT_THAT(refusal("/proc/self/mem"), HasSubstr("cannot be read"));
}

TEST_F(InputFileTest, WhatIsTooLargeIsNotTakenIntoMemory) {
  const std::string huge = write("huge", "");
  std::filesystem::resize_file(huge, std::uintmax_t{100} << 30);
  EXPECT_THAT(refusal(huge), AllOf(HasSubstr("has 102400 MiB"), HasSubstr("at most 1 MiB")));
  EXPECT_THAT(refusal(write("more", std::string(kMost + 1, 'x'))), HasSubstr("at most 1 MiB"));
}

TEST_F(InputFileTest, ATextWithANulIsNoText) {
  EXPECT_THAT(refusal(write("nul", std::string("a\nb\0c", 5))), AllOf(HasSubstr("NUL"), HasSubstr("line 2")));
}

TEST_F(InputFileTest, TheMachineIsToBlameForTooManyOpenFiles) {
  const std::string file = write("a", "x");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit none = {0, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  std::string text;
  try {
    static_cast<void>(input_file(file, "the list", "a text file", kMost));
  } catch (const SystemError& error) {
    text = error.what();
  }
  ::setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_THAT(text, HasSubstr("Too many open files"));
}

}  // namespace
}  // namespace assay
