#pragma once

#include "book/figures.hpp"

/// One function a figure or table, in the folder of its chapter. They unpack every `Expected` with
/// value(): the constants are the book's, so a refusal is thrown to the one who asked for the
/// figure.
namespace flyball::book {

[[nodiscard]] FigureResult figure_2_3();
[[nodiscard]] FigureResult figure_2_5();
[[nodiscard]] FigureResult figure_2_6();
[[nodiscard]] FigureResult figure_2_7();
[[nodiscard]] FigureResult figure_2_9();
[[nodiscard]] FigureResult figure_6_1();
[[nodiscard]] FigureResult figure_6_3();
[[nodiscard]] FigureResult figure_6_5();
[[nodiscard]] FigureResult figure_6_6();
[[nodiscard]] FigureResult figure_6_7();
[[nodiscard]] FigureResult figure_6_9();
[[nodiscard]] FigureResult figure_7_1();
[[nodiscard]] FigureResult figure_7_2();
[[nodiscard]] FigureResult figure_7_3();
[[nodiscard]] FigureResult figure_7_4();
[[nodiscard]] FigureResult figure_7_5();
[[nodiscard]] FigureResult figure_7_6();
[[nodiscard]] FigureResult figure_7_7();
[[nodiscard]] FigureResult figure_7_8();
[[nodiscard]] FigureResult figure_7_10();
[[nodiscard]] FigureResult figure_8_3();
[[nodiscard]] FigureResult figure_8_4();
[[nodiscard]] FigureResult figure_8_5();
[[nodiscard]] FigureResult figure_8_6();
[[nodiscard]] FigureResult figure_8_7();
[[nodiscard]] FigureResult figure_8_8();
[[nodiscard]] FigureResult figure_8_9();
[[nodiscard]] FigureResult figure_8_10();
[[nodiscard]] FigureResult figure_8_11();
[[nodiscard]] FigureResult figure_8_12();
[[nodiscard]] FigureResult figure_8_13();
[[nodiscard]] FigureResult figure_9_1();
[[nodiscard]] FigureResult figure_9_2();
[[nodiscard]] FigureResult figure_9_3();
[[nodiscard]] FigureResult figure_9_4();
[[nodiscard]] FigureResult figure_9_5();
[[nodiscard]] FigureResult figure_9_6();
[[nodiscard]] FigureResult figure_9_7();
[[nodiscard]] FigureResult figure_9_8();
[[nodiscard]] FigureResult figure_9_9();
[[nodiscard]] FigureResult figure_10_1();
[[nodiscard]] FigureResult figure_10_2();
[[nodiscard]] FigureResult figure_10_3();
[[nodiscard]] FigureResult figure_10_4();
[[nodiscard]] FigureResult figure_12_2();
[[nodiscard]] FigureResult figure_15_1();
[[nodiscard]] FigureResult figure_15_2();
[[nodiscard]] FigureResult figure_16_1();
[[nodiscard]] FigureResult figure_16_2();
[[nodiscard]] FigureResult figure_16_3();
[[nodiscard]] FigureResult figure_16_4();
[[nodiscard]] FigureResult figure_17_1();
[[nodiscard]] FigureResult figure_17_2();
[[nodiscard]] FigureResult figure_17_3();
[[nodiscard]] FigureResult figure_B_1();
[[nodiscard]] FigureResult figure_B_2();
[[nodiscard]] FigureResult figure_B_3();
[[nodiscard]] FigureResult figure_B_4();
[[nodiscard]] FigureResult figure_B_5();
[[nodiscard]] FigureResult figure_B_6();
[[nodiscard]] FigureResult figure_C_1();
[[nodiscard]] FigureResult figure_C_2();
[[nodiscard]] FigureResult figure_C_3();
[[nodiscard]] FigureResult figure_E_1();
[[nodiscard]] FigureResult figure_E_2();
[[nodiscard]] FigureResult figure_E_5();
[[nodiscard]] FigureResult figure_E_6();
[[nodiscard]] FigureResult figure_E_9();
[[nodiscard]] FigureResult figure_E_10();
[[nodiscard]] FigureResult figure_E_11();
[[nodiscard]] FigureResult figure_E_13();
[[nodiscard]] FigureResult figure_E_14();
[[nodiscard]] FigureResult figure_E_15();
[[nodiscard]] FigureResult figure_E_16();
[[nodiscard]] FigureResult figure_E_17();
[[nodiscard]] FigureResult figure_E_18();
[[nodiscard]] FigureResult figure_E_19();
[[nodiscard]] FigureResult figure_E_20();
[[nodiscard]] FigureResult figure_E_21();
[[nodiscard]] FigureResult figure_E_22();
[[nodiscard]] FigureResult figure_E_23();
[[nodiscard]] FigureResult figure_E_24();
[[nodiscard]] FigureResult figure_E_25();
[[nodiscard]] FigureResult table_7_1();
[[nodiscard]] FigureResult table_7_2();
[[nodiscard]] FigureResult table_7_3();
[[nodiscard]] FigureResult table_E_1();
[[nodiscard]] FigureResult table_E_2();
[[nodiscard]] FigureResult table_E_3();

}  // namespace flyball::book
