// The page that web/ is bundled into, in two halves: the data goes between them.
#pragma once

#include <string_view>

namespace assay {

std::string_view report_page_before();
std::string_view report_page_after();

}  // namespace assay
