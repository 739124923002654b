#pragma once

#include <cstddef>
#include <cstdint>

#include <flyball/math/expression/lane_tape.hpp>

#include "math/dense/instruction_set.hpp"

namespace flyball::expression::detail {

/// Codes of steps that are no operation of a tape.
enum Fused : std::uint32_t {
  multiply_add = 1000,   ///< a b + c
  multiply_subtract,     ///< a b - c
  negated_multiply_add,  ///< c - a b
};

/// Runs steps over all lanes of a workspace; one variant for each kind of processor.
using RunSteps = void (*)(const LaneTape::Step* steps, std::size_t count, double* work) noexcept;

namespace baseline {
void run_steps(const LaneTape::Step* steps, std::size_t count, double* work) noexcept;
}
namespace wide {
void run_steps(const LaneTape::Step* steps, std::size_t count, double* work) noexcept;
}
namespace widest {
void run_steps(const LaneTape::Step* steps, std::size_t count, double* work) noexcept;
}

/// Those of the operations that have no vector form, lane by lane.
void run_scalar(Operation operation, const double* a, const double* b, const double* c,
                double* to) noexcept;

}  // namespace flyball::expression::detail
