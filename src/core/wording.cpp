#include <algorithm>
#include <cmath>
#include <limits>

#include "core/format.hpp"
#include "core/wording.hpp"

namespace flyball::text {

namespace {

/// Decimals that show `digits` significant digits of a magnitude.
int decimals_for(double magnitude, int digits) {
  return digits - 1 - static_cast<int>(std::floor(std::log10(magnitude)));
}

std::string without_trailing_zeros(std::string text) {
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') {
      text.pop_back();
    }
  }
  return text == "-0" ? "0" : text;
}

}  // namespace

std::string number(double value, int digits) {
  if (std::isnan(value)) {
    return "none";
  }
  if (std::isinf(value)) {
    return value > 0.0 ? "∞" : "-∞";
  }
  const double magnitude = std::abs(value);
  // Of a subnormal number, as broken recorders write, no digit is right.
  if (magnitude < std::numeric_limits<double>::min()) {
    return "0";
  }
  if (magnitude < 1e-4 || magnitude >= 1e6) {
    return detail::format("{:.{}g}", value, digits);
  }
  return without_trailing_zeros(
      detail::format("{:.{}f}", value, std::max(0, decimals_for(magnitude, digits))));
}

std::string exact(double value) {
  return std::isnan(value) ? "NaN" : detail::format("{}", value);
}

std::string in_digits_of(double value, double half_width) {
  if (!std::isfinite(value) || !std::isfinite(half_width) || half_width <= 0.0) {
    return number(value);
  }
  const int decimals = decimals_for(half_width, 2);
  if (decimals > 8 || std::max(std::abs(value), half_width) >= 1e6) {
    return number(value);
  }
  return detail::format("{:.{}f}", value, std::max(0, decimals));
}

std::string with_half_width(double value, double half_width) {
  if (!std::isfinite(half_width) || half_width <= 0.0) {
    return number(value);
  }
  return in_digits_of(value, half_width) + " ± " + in_digits_of(half_width, half_width);
}

std::string percent(double ratio, int digits) {
  // Below a thousandth of a per cent is nothing that anybody could see.
  const double shown = std::abs(ratio) < 1e-5 ? 0.0 : 100.0 * ratio;
  return std::isnan(ratio) ? "none" : number(shown, digits) + " %";
}

std::string seconds(double value) {
  if (std::isfinite(value) && std::abs(value) < 1.0) {
    return number(1e3 * value, 3) + " ms";
  }
  return number(value, 4) + " s";
}

std::string complex_number(std::complex<double> value, int digits) {
  const double imaginary = std::abs(value.imag());
  if (imaginary <= 1e-12 * std::max(1.0, std::abs(value))) {
    return number(value.real(), digits);
  }
  return detail::format("{} ± {}j", number(value.real(), digits), number(imaginary, digits));
}

std::string matrix(const Eigen::MatrixXd& M, int digits) {
  std::string text = "[";
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    text += i == 0 ? "" : "; ";
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      text += j == 0 ? "" : "  ";
      text += number(M(i, j), digits);
    }
  }
  return text + "]";
}

std::string valid_utf8(std::string_view text) {
  constexpr std::string_view replacement = "\xEF\xBF\xBD";
  std::string out;
  out.reserve(text.size());
  std::size_t i = 0;
  while (i < text.size()) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80                   ? 1
                               : lead >= 0xC2 && lead < 0xE0 ? 2
                               : lead >= 0xE0 && lead < 0xF0 ? 3
                               : lead >= 0xF0 && lead < 0xF5 ? 4
                                                             : 0;
    bool valid = length > 0 && i + length <= text.size();
    for (std::size_t k = 1; valid && k < length; ++k) {
      valid = (static_cast<unsigned char>(text[i + k]) & 0xC0U) == 0x80U;
    }
    if (valid) {
      out += text.substr(i, length);
      i += length;
    } else {
      out += replacement;
      ++i;
    }
  }
  return out;
}

std::vector<std::string_view> split(std::string_view text, std::string_view separator) {
  std::vector<std::string_view> pieces;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find(separator, start), text.size());
    pieces.push_back(text.substr(start, end - start));
    start = end + separator.size();
  }
  return pieces;
}

std::string enumerate(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += i == 0 ? "" : i + 1 == words.size() ? " and " : ", ";
    text += words[i];
  }
  return text;
}

std::string count(std::size_t n, std::string_view thing) {
  return detail::format("{} {}{}", n, thing, n == 1 ? "" : "s");
}

std::string capitalized(std::string_view name) {
  std::string text(name);
  if (!text.empty() && text.front() >= 'a' && text.front() <= 'z') {
    text.front() = static_cast<char>(text.front() - 'a' + 'A');
  }
  return text;
}

}  // namespace flyball::text
