#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/solve/kind.hpp>

/// The shapes of fields: letters that stand for sizes.
namespace flyball::solve {

/// What a letter counts in the shapes of fields, whatever the kind.
struct Letter {
  char letter;
  std::string_view counts;
};
[[nodiscard]] std::span<const Letter> all_letters();
/// Those of a kind's fields.
[[nodiscard]] std::vector<Letter> letters_of(const Kind& kind);

/// What the letters of one problem stand for, as far as its fields have said.
class Sizes {
 public:
  Sizes() { known_.fill(-1); }

  [[nodiscard]] bool knows(std::string_view size) const { return value_of(size) >= 0; }
  /// What "n", "1" or "n+p" is. @param actual  What a letter that is new stands for from now on.
  Eigen::Index bind(std::string_view size, Eigen::Index actual);

 private:
  [[nodiscard]] Eigen::Index value_of(std::string_view size) const;

  std::array<Eigen::Index, 128> known_;  ///< By letter.
};

/// Shape, at least one entry, and all of them finite.
/// @param name  The field's whole name, such as "first.A".
/// @errors ArgumentError::wrong_shape with the shape in words, empty, not_finite.
[[nodiscard]] Expected<void> check_shape_of(const Eigen::MatrixXd& M, const Field& field,
                                            Sizes& sizes, std::string_view where,
                                            std::string_view name);

/// "n x m", "n", or nothing for what has no shape.
[[nodiscard]] std::string shape_of(const Field& field);

}  // namespace flyball::solve
