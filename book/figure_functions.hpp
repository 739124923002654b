#pragma once

#include "book/figures.hpp"

/// One function a figure, each in the file of its name. They unpack every `Expected` with value():
/// the constants are the book's, so a refusal is thrown to the one who asked for the figure.
namespace flyball::book {

[[nodiscard]] FigureResult figure_2_3();
[[nodiscard]] FigureResult figure_6_3();
[[nodiscard]] FigureResult figure_6_5();
[[nodiscard]] FigureResult figure_6_9();
[[nodiscard]] FigureResult figure_7_7();

}  // namespace flyball::book
