// How assay's processes end, and how what is thrown becomes such an end.
#pragma once

#include <functional>

namespace assay {

// Statuses of the program: 0 done, 1 failed, 2 wrong usage or input.
namespace exits {
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongInput = 2;
}  // namespace exits

// The status of `work`, or of what it throws, with its message printed.
int guarded(const std::function<int()>& work);

}  // namespace assay
