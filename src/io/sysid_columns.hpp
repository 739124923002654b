#pragma once

#include <array>
#include <span>
#include <string_view>

#include <flyball/io/sysid_json.hpp>

/// Where each column of a row goes, for the reader and the writer; nullptr is not kept.
namespace flyball::io {

inline constexpr std::array<std::string_view, 4> run_names = {"slow-forward", "slow-backward",
                                                              "fast-forward", "fast-backward"};

using Run = SysIdJson::Run;
using Column = std::vector<double> Run::*;

inline constexpr std::array<Column, 4> columns_mechanism = {&Run::time, &Run::voltage,
                                                            &Run::position, &Run::velocity};
inline constexpr std::array<Column, 9> columns_drive = {
    &Run::time,           &Run::voltage,        &Run::right_voltage,
    &Run::position,       &Run::right_position, &Run::velocity,
    &Run::right_velocity, &Run::angle,          &Run::angle_rate};
inline constexpr std::array<Column, 10> columns_2020 = {&Run::time,
                                                        nullptr,
                                                        nullptr,
                                                        &Run::voltage,
                                                        &Run::right_voltage,
                                                        &Run::position,
                                                        &Run::right_position,
                                                        &Run::velocity,
                                                        &Run::right_velocity,
                                                        &Run::angle};

[[nodiscard]] inline std::span<const Column> columns_of(SysIdJson::Layout layout) {
  switch (layout) {
    case SysIdJson::Layout::mechanism:
      return columns_mechanism;
    case SysIdJson::Layout::drive:
      return columns_drive;
    case SysIdJson::Layout::characterization_2019:
      return std::span(columns_2020).first(9);  // without the angle
    case SysIdJson::Layout::characterization_2020:
      return columns_2020;
  }
  return {};
}

}  // namespace flyball::io
