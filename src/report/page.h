// The page that web/ is bundled into, in three parts: the data goes between the first two, the replays between the last
// two. The page's script stands in the middle, so that it begins before a browser has read the replays.
#pragma once

#include <string_view>

namespace assay {

std::string_view report_page_before();
std::string_view report_page_between();
std::string_view report_page_after();

}  // namespace assay
