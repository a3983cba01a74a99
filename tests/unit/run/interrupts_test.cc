// Signals are noted from the outermost Interrupts' beginning to its end.
#include <array>
#include <csignal>

#include <gtest/gtest.h>
#include <poll.h>

#include "run/coordinator/pool.h"

namespace assay {
namespace {

bool readable(const Interrupts& interrupts) {
  std::array<pollfd, 1> polled = {{{interrupts.descriptor(), POLLIN, 0}}};
  return ::poll(polled.data(), polled.size(), 0) == 1;
}

TEST(Interrupts, OneThatComesBetweenTwoPassesIsSeenByTheNext) {
  const Interrupts search;
  {
    const Interrupts pass;
  }
  ASSERT_EQ(std::raise(SIGINT), 0);
  const Interrupts next;
  EXPECT_EQ(next.signal(), SIGINT);
  EXPECT_TRUE(readable(next));
}

TEST(Interrupts, OneThatAPassHasNotedOutlivesIt) {
  const Interrupts search;
  {
    const Interrupts pass;
    ASSERT_EQ(std::raise(SIGTERM), 0);
  }
  EXPECT_EQ(search.signal(), SIGTERM);
  const Interrupts next;
  EXPECT_EQ(next.signal(), SIGTERM);
  EXPECT_TRUE(readable(next));
}

TEST(Interrupts, ABudgetEndsOnePassAndNoUsersSignal) {
  const Interrupts search;
  {
    const Interrupts pass;
    ASSERT_EQ(std::raise(SIGALRM), 0);
    EXPECT_EQ(pass.signal(), SIGALRM);
    EXPECT_TRUE(readable(pass));
  }
  const Interrupts next;
  EXPECT_EQ(next.signal(), 0);
  EXPECT_FALSE(readable(next));
  ASSERT_EQ(std::raise(SIGINT), 0);
  ASSERT_EQ(std::raise(SIGALRM), 0);
  EXPECT_EQ(next.signal(), SIGINT);
}

TEST(Interrupts, TheNextSearchBeginsAnew) {
  {
    const Interrupts search;
    ASSERT_EQ(std::raise(SIGINT), 0);
  }
  const Interrupts search;
  EXPECT_EQ(search.signal(), 0);
  EXPECT_FALSE(readable(search));
}

}  // namespace
}  // namespace assay
