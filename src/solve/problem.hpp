#pragma once

#include <complex>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include <flyball/solve/kind.hpp>
#include <flyball/systems/analysis.hpp>

#include "solve/json_tree.hpp"

namespace flyball::solve {

/// A transfer function as it is written: nothing of it is checked but that its lists are numbers.
struct TransferCoefficients {
  std::optional<std::string> expr{};  ///< In place of num and den.
  Eigen::VectorXd num{};              ///< Descending powers.
  Eigen::VectorXd den{};
  double dt = 0.0;     ///< s; 0 of a continuous one.
  double delay = 0.0;  ///< s
};

/// The fields of one object, read and checked against their rows.
class Problem {
 public:
  /// Every field known, every necessary one there, each of its type and shape, all numbers finite.
  /// The table may be a kind's or that of a file.
  /// @param fields  They must outlive the problem; a field `id` is known everywhere.
  /// @param where   The kind of problem or the file, for messages.
  /// @errors ArgumentError::unknown_name with the nearest name; malformed for a field left out or
  ///         of another type; wrong_shape, empty, not_finite.
  [[nodiscard]] static Expected<Problem> read(JsonValue object, std::span<const Field> fields,
                                              std::string_view where);

  // A field by its name in the row; what `has` denies must not be asked for unless the row says
  // what stands for it.
  [[nodiscard]] bool has(std::string_view name) const;
  [[nodiscard]] double number(std::string_view name) const { return get<double>(name); }
  [[nodiscard]] int integer(std::string_view name) const {
    return static_cast<int>(get<double>(name));
  }
  [[nodiscard]] std::string_view choice(std::string_view name) const {
    return get<std::string_view>(name);
  }
  /// Also of samples, and of a list as its only column.
  [[nodiscard]] const Eigen::MatrixXd& matrix(std::string_view name) const {
    return get<Eigen::MatrixXd>(name);
  }
  [[nodiscard]] const Eigen::VectorXcd& complex_list(std::string_view name) const {
    return get<Eigen::VectorXcd>(name);
  }
  [[nodiscard]] const ContinuousSystem<>& system(std::string_view name) const {
    return get<ContinuousSystem<>>(name);
  }
  [[nodiscard]] const TransferCoefficients& transfer(std::string_view name) const {
    return get<TransferCoefficients>(name);
  }
  [[nodiscard]] const std::string& text(std::string_view name) const {
    return get<std::string>(name);
  }
  /// Rows of one length.
  [[nodiscard]] const std::vector<std::vector<TransferCoefficients>>& transfers(
      std::string_view name) const {
    return get<std::vector<std::vector<TransferCoefficients>>>(name);
  }
  [[nodiscard]] const std::vector<Problem>& objects(std::string_view name) const {
    static const std::vector<Problem> none{};
    const auto& held = get<std::shared_ptr<const std::vector<Problem>>>(name);
    return held ? *held : none;
  }
  [[nodiscard]] const std::vector<std::string>& texts(std::string_view name) const {
    return get<std::vector<std::string>>(name);
  }

  /// The choice named domain.
  [[nodiscard]] TimeDomain domain() const {
    return choice("domain") == "discrete" ? TimeDomain::discrete : TimeDomain::continuous;
  }
  /// The matrices A, B, C and D.
  [[nodiscard]] ContinuousSystem<> system() const {
    return {matrix("A"), matrix("B"), matrix("C"), matrix("D")};
  }

 private:
  using Value =
      std::variant<std::monostate, double, std::string_view, Eigen::MatrixXd, Eigen::VectorXcd,
                   ContinuousSystem<>, std::vector<std::string>, TransferCoefficients, std::string,
                   std::vector<std::vector<TransferCoefficients>>,
                   std::shared_ptr<const std::vector<Problem>>>;
  friend class ProblemReader;

  [[nodiscard]] std::size_t index_of(std::string_view name) const;
  /// A name or type that the row does not have is a defect of the kind's function, which the test
  /// of its example meets.
  template <class T>
  [[nodiscard]] const T& get(std::string_view name) const {
    static const T none{};
    const T* value = std::get_if<T>(&values_[index_of(name)]);
    return value == nullptr ? none : *value;
  }

  std::span<const Field> fields_;
  std::vector<Value> values_;  ///< One a field and an empty one.
  std::uint64_t given_ = 0;    ///< A bit a field: whether the problem had it.
};

}  // namespace flyball::solve
