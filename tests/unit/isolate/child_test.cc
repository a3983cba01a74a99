// Child processes: what they send arrives whole, and their ends are told apart.
#include "isolate/child.h"

#include <csignal>
#include <fcntl.h>
#include <string>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace assay {
namespace {

TEST(Child, SendsMoreThanAPipeHoldsAndEndsWithItsStatus) {
  const std::string much(300'000, 'x');
  Pipe pipe = make_pipe();
  constexpr int kStatus = 7;
  const pid_t child = start_child([&] { return write_all(pipe.writing.get(), much) ? kStatus : 0; });
  pipe.writing.close();
  EXPECT_EQ(read_to_end(pipe.reading.get()), much);
  const int status = wait_for(child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), kStatus);
  EXPECT_EQ(end_text(status), "exit status 7");
}

TEST(Child, ItsSignalIsNamed) {
  const pid_t child = start_child([] {
    std::signal(SIGTERM, SIG_DFL);
    std::raise(SIGTERM);
    return 0;
  });
  const int status = wait_for(child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(end_text(status), "signal 15 (Terminated)");
  EXPECT_EQ(signal_text(WTERMSIG(status)), "SIGTERM (Terminated)");
}

TEST(Child, AskedAndAnsweringOverASocket) {
  Pipe ends = make_socket_pair();
  const pid_t child = start_child([&] {
    ends.reading.close();
    int asked = 0;
    if (!read_all(ends.writing.get(), &asked, sizeof asked)) return 1;
    ++asked;
    return write_all(ends.writing.get(), &asked, sizeof asked) ? 0 : 1;
  });
  ends.writing.close();
  int number = 41;
  ASSERT_TRUE(write_all(ends.reading.get(), &number, sizeof number));
  ASSERT_TRUE(read_all(ends.reading.get(), &number, sizeof number));
  EXPECT_EQ(number, 42);
  EXPECT_EQ(wait_for(child), 0);
  EXPECT_FALSE(read_all(ends.reading.get(), &number, sizeof number)) << "the other end is closed";
  EXPECT_FALSE(write_all(ends.reading.get(), std::string(1 << 20, 'x'))) << "nobody reads, and no SIGPIPE";
}

TEST(Child, ReadingDoesNotWaitWhereTheDescriptorDoesNot) {
  Pipe pipe = make_pipe();
  ::fcntl(pipe.reading.get(), F_SETFL, O_NONBLOCK);
  std::string text;
  EXPECT_TRUE(read_available(pipe.reading.get(), text, 100));
  EXPECT_EQ(text, "");
  ASSERT_TRUE(write_all(pipe.writing.get(), "abc"));
  EXPECT_TRUE(read_available(pipe.reading.get(), text, 100));
  EXPECT_EQ(text, "abc");
  pipe.writing.close();
  EXPECT_FALSE(read_available(pipe.reading.get(), text, 100));
}

TEST(Child, ADescriptorIsClosedWithItsOwner) {
  int number = -1;
  {
    Pipe pipe = make_pipe();
    number = pipe.reading.get();
    const Descriptor owner = std::move(pipe.reading);
    EXPECT_EQ(owner.get(), number);
    EXPECT_FALSE(pipe.reading.is_open());
    EXPECT_NE(::fcntl(number, F_GETFD), -1);
  }
  EXPECT_EQ(::fcntl(number, F_GETFD), -1);
}

TEST(Child, EndsWithItsParent) {
  Pipe from_grandchild = make_pipe();
  const pid_t parent = start_child([&] {
    start_child([&] {
      write_all(from_grandchild.writing.get(), "here");
      while (true) ::pause();
      return 0;
    });
    std::string heard(4, ' ');
    read_all(from_grandchild.reading.get(), heard.data(), heard.size());
    return heard == "here" ? 0 : 1;
  });
  from_grandchild.writing.close();
  EXPECT_EQ(wait_for(parent), 0);
  // the grandchild held the other end until it was ended
  EXPECT_EQ(read_to_end(from_grandchild.reading.get()), "");
}

}  // namespace
}  // namespace assay
