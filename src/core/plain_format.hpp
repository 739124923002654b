#pragma once

#include <concepts>
#include <string>
#include <string_view>
#include <variant>

/// fmt's patterns of numbers and text, for builds of the numeric library where fmt is not
/// installed: {}, {0}, {:.3g}, {:.0f}, {:.{}g}.
namespace flyball::detail::plain {

/// What stands for one pair of braces.
class Argument {
 public:
  template <std::floating_point T>
  Argument(T value) : value_(static_cast<double>(value)) {}  // NOLINT: as fmt takes them
  template <std::integral T>
  Argument(T value) {  // NOLINT
    if constexpr (std::same_as<T, char>) {
      value_ = std::string(1, value);
    } else if constexpr (std::same_as<T, bool>) {
      value_ = std::string(value ? "true" : "false");
    } else if constexpr (std::unsigned_integral<T>) {
      value_ = static_cast<unsigned long long>(value);
    } else {
      value_ = static_cast<long long>(value);
    }
  }
  template <class T>
    requires std::convertible_to<const T&, std::string_view>
  Argument(const T& text) : value_(std::string(std::string_view(text))) {}  // NOLINT

  /// The number of a nested {}; -1 for none.
  [[nodiscard]] int whole() const;
  /// @param specification  What stands behind the colon, without nested braces: ".3g".
  [[nodiscard]] std::string text(std::string_view specification) const;

 private:
  std::variant<std::string, double, long long, unsigned long long> value_;
};

[[nodiscard]] std::string format(std::string_view pattern, const Argument* arguments,
                                 std::size_t count);

}  // namespace flyball::detail::plain
