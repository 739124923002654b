#pragma once

#include <string>
#include <vector>

#include <flyball/study/loop_study.hpp>

/// Pieces of the answer about loops.
namespace flyball::study {

/// Of the answer's JSON.
inline constexpr const char* loop_schema = "flyball.loop/1";
[[nodiscard]] std::string to_json(const LoopResult& result);

/// The pictures of a view, in the order in which they are looked at.
[[nodiscard]] std::vector<Figure> figures_of(const LoopResult& result);
/// The same as CSV.
[[nodiscard]] std::vector<AnswerFile> data_files(const LoopResult& result);

/// An expression for a legend: its beginning, where it is long.
[[nodiscard]] std::string short_name(const LoopFindings& loop);

}  // namespace flyball::study
