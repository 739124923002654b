#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "export/loop_program.hpp"

/// One description of a loop's work, written in several languages.
namespace flyball::exports {

/// How a language writes what a loop is made of. Every answer but an expression is whole lines.
/// Names are those of LoopProgram; members end in an underscore.
class LoopLanguage {
 public:
  LoopLanguage() = default;
  LoopLanguage(const LoopLanguage&) = delete;
  LoopLanguage& operator=(const LoopLanguage&) = delete;
  virtual ~LoopLanguage() = default;

  [[nodiscard]] virtual std::string comment(std::string_view text) const = 0;
  /// A number that stays. @param value  An expression.
  [[nodiscard]] virtual std::string constant(std::string_view name,
                                             const std::string& value) const = 0;
  /// A number that changes.
  [[nodiscard]] virtual std::string variable(std::string_view name,
                                             const std::string& value) const = 0;
  [[nodiscard]] virtual std::string set(std::string_view target,
                                        const std::string& value) const = 0;
  /// A state of this function: x, demand or error.
  [[nodiscard]] virtual std::string state(std::string_view name) const = 0;
  [[nodiscard]] virtual std::string copy(std::string_view target,
                                         std::string_view source) const = 0;
  [[nodiscard]] virtual std::string copy_if(const std::string& condition, std::string_view target,
                                            std::string_view source) const = 0;
  /// A member of numbers, all zero again.
  [[nodiscard]] virtual std::string clear(std::string_view member) const = 0;
  /// What is done for an index from one to below on_the_way.
  [[nodiscard]] virtual std::string for_each_on_the_way(std::string_view index,
                                                        const std::string& lines) const = 0;
  [[nodiscard]] virtual std::string answer(std::string_view name) const = 0;

  /// An expression: one or the other.
  [[nodiscard]] virtual std::string choose(const std::string& condition, const std::string& yes,
                                           const std::string& no) const = 0;
  [[nodiscard]] virtual std::string both(const std::string& a, const std::string& b) const = 0;
  /// usable, usable_state, usable_or_zero, limited, believable, cut, is_nan or cosine.
  [[nodiscard]] virtual std::string call(std::string_view function,
                                         const std::string& arguments) const = 0;
};

/// What C++ and Java write alike.
class BracesLanguage : public LoopLanguage {
 public:
  [[nodiscard]] std::string comment(std::string_view text) const override;
  [[nodiscard]] std::string answer(std::string_view name) const override;
  [[nodiscard]] std::string choose(const std::string& condition, const std::string& yes,
                                   const std::string& no) const override;
  [[nodiscard]] std::string both(const std::string& a, const std::string& b) const override;
};

/// The lines of `update`: from measurement, r, r_next and battery_voltage to the answer.
[[nodiscard]] std::string update_lines(const LoopProgram& program, const LoopLanguage& language);

/// The lines of `reset`: position and velocity, or velocity alone, to the state.
[[nodiscard]] std::string reset_lines(const LoopProgram& program, const LoopLanguage& language);

/// Those of a helper for readers, without the comment's marks: what the loop is and does.
[[nodiscard]] std::vector<std::string> description(const LoopProgram& program);

/// "1.0, 2.0": a row's or a column's numbers.
[[nodiscard]] std::string literals(const Eigen::MatrixXd& row);

/// Lines two columns further right.
[[nodiscard]] std::string indented(const std::string& lines);

/// An identifier of every one of the languages.
[[nodiscard]] std::string identifier(std::string_view wanted);

[[nodiscard]] std::string cpp_loop(const LoopProgram& program, const std::string& name);
[[nodiscard]] std::string java_loop(const LoopProgram& program, const std::string& name);
[[nodiscard]] std::string python_loop(const LoopProgram& program, const std::string& name);

}  // namespace flyball::exports
