#include "simflex/base/NumberText.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace simflex {
namespace {

constexpr size_t LongestNumber = 64;

}  // namespace

bool readNumber(std::string_view field, double& value) {
    if (field.empty() || field.size() > LongestNumber) return false;
    char text[LongestNumber + 1];
    std::copy(field.begin(), field.end(), text);
    for (size_t k = 0; k < field.size(); ++k)
        if (text[k] == 'd' || text[k] == 'D') text[k] = 'e';
    text[field.size()] = 0;
    const char* begin = text + (text[0] == '+' && field.size() > 1 && text[1] != '-');
    const char* end = text + field.size();
    const auto result = std::from_chars(begin, end, value);
    if (result.ptr != end) return false;
    if (result.ec == std::errc::result_out_of_range) {
        value = 0;
        return std::strstr(begin, "e-") || std::strstr(begin, "E-");  // underflow, not overflow
    }
    return result.ec == std::errc() && std::isfinite(value);
}

bool readInteger(std::string_view field, int& value) {
    if (field.size() > 1 && field[0] == '+' && field[1] != '-') field.remove_prefix(1);
    const char* end = field.data() + field.size();
    const auto result = std::from_chars(field.data(), end, value);
    return result.ec == std::errc() && result.ptr == end;
}

}  // namespace simflex
