// A fixture with a folder of its own, which does not exist at first and is gone afterwards.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <unistd.h>

#include <gtest/gtest.h>

namespace assay {

class TempFolderTest : public ::testing::Test {
 public:
  TempFolderTest() {
    // Parameterised tests have a slash in their names.
    std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::ranges::replace(name, '/', '-');
    dir_ = std::filesystem::temp_directory_path() / ("assay-test-" + std::to_string(::getpid()) + "-" + name);
    std::filesystem::remove_all(dir_);
  }
  ~TempFolderTest() override {
    // A test may have taken its own permission away.
    std::error_code error;
    std::filesystem::permissions(dir_, std::filesystem::perms::owner_all, error);
    std::filesystem::remove_all(dir_, error);
  }
  TempFolderTest(const TempFolderTest&) = delete;
  TempFolderTest& operator=(const TempFolderTest&) = delete;

 protected:
  std::filesystem::path dir_;
};

}  // namespace assay
