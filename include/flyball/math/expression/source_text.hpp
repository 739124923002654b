#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/math/expression/tape.hpp>

namespace flyball::expression {

/// What a tape can be written in.
enum class Language : std::uint8_t {
  formula,  ///< Flyball's own, which `compile` reads.
  c,        ///< With the math.h header.
  cpp,      ///< With the headers cmath, algorithm and limits.
  java,
};

/// A tape as text: definitions in order, each of the inputs, the parameters and those before it,
/// then the outputs.
struct SourceText {
  /// name = text.
  struct Definition {
    std::string name;
    std::string text;
    bool truth = false;  ///< bool rather than double.
  };
  std::vector<Definition> definitions;
  std::vector<std::string> outputs;
};

/// A tape in a language: what is used more than once, or is long, has a name of its own, t1, t2, …
/// (another letter if that is taken). The operations are those of the tape in its order, so that
/// the text computes the same numbers, with these exceptions: `chain` is a plain product, `mod` is
/// a - b⌊a/b⌋, in Java and C min and max of a NaN differ, and Java, which lacks asinh, acosh,
/// atanh, log2 and round, computes them from others, to a few units in the last place.
/// @param inputs, parameters  A name for each, as the language wants it.
/// @errors ExpressionError::no_counterpart for erf in Java; ArgumentError::wrong_shape for too few
/// names. Cost: linear in the tape; allocates.
[[nodiscard]] Expected<SourceText> source_text(const Tape& tape,
                                               std::span<const std::string> inputs,
                                               std::span<const std::string> parameters,
                                               Language language);

}  // namespace flyball::expression
