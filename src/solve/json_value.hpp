#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solve/json_tree.hpp"

/// Values of a JSON object, as the numbers and matrices that they stand for.
namespace flyball::solve {

/// Why a value is not what it should be; nothing if it is.
struct Complaint {
  std::string got;
  std::string expected;
};
using Verdict = std::optional<Complaint>;

/// What stands there, in a few words; lists and objects may be of any size.
[[nodiscard]] std::string kind_of(JsonValue value);

/// A number, or the texts "inf", "-inf" and "nan" that stand for what JSON cannot write.
[[nodiscard]] bool read_number(JsonValue value, double& number);

/// A list of rows of one length; a number is 1 x 1.
[[nodiscard]] Verdict read_rows(JsonValue value, Eigen::MatrixXd& M);

/// A list of numbers, as a column.
[[nodiscard]] Verdict read_column(JsonValue value, Eigen::MatrixXd& column);

/// A list of [re, im] and of numbers.
[[nodiscard]] Verdict read_complex_list(JsonValue value, Eigen::VectorXcd& list);

[[nodiscard]] Verdict read_texts(JsonValue value, std::vector<std::string>& texts);

}  // namespace flyball::solve
