"""A check for this exercise alone: the result of each goal is the Fibonacci sequence up to its order."""

from dataclasses import dataclass
from itertools import zip_longest

from grader.api import Finding, HarnessError, Trace, calls_of, met, not_met


@dataclass(frozen=True)
class ResultFacts:
    """What hint rules may know of a wrong result."""

    lacking: int  # numbers that are missing at its end, if all others are right; 0 otherwise


@dataclass(frozen=True)
class FibonacciResults:
    """Every goal has a result with the Fibonacci numbers from number 0 to its order: `0, 1, 1, 2, 3, 5` for order 5.

    Attributes:
        action: Name of the action.
        at_least: Number of results needed for a judgement.
    """

    action: str
    at_least: int = 1

    def judge(self, trace: Trace) -> Finding:
        """Compare number by number; the reason names the first that differs."""
        goals = calls_of(trace, f"{self.action}/_action/send_goal", "grader")
        if not goals and trace.service_ends("service", f"{self.action}/_action/send_goal"):
            raise HarnessError(f"{self.action}: no goal was sent to it")
        answers = calls_of(trace, f"{self.action}/_action/get_result", "grader")
        results = {str(a.request.value["goal_id"]): a.response.value["result"] for a in answers if a.response}
        compared = 0
        for goal in goals:
            order = goal.request.value["goal"]["order"]
            result = results.get(str(goal.request.value["goal_id"]))
            if result is None:
                continue
            compared += 1
            for place, (got, wanted) in enumerate(zip_longest(result["sequence"], fibonacci(order))):
                if got != wanted:
                    found, expected = ("none" if n is None else n for n in (got, wanted))
                    reason = f"{self.action}, order {order}: number {place} is {found}, expected {expected}"
                    numbers, right = list(result["sequence"]), fibonacci(order)
                    lacking = len(right) - len(numbers) if numbers == right[: len(numbers)] else 0
                    facts = ResultFacts(lacking)
                    return not_met(reason, {"order": order, "sequence": numbers[:50]}, facts=facts)
        if compared < self.at_least:
            reason = f"{self.action}: {compared} results, expected at least {self.at_least}"
            return not_met(reason, {"results": compared}, blocked_by="action_result")
        return met(f"{self.action}: {compared} results, each with the right numbers", {"results": compared})


def fibonacci(order: int) -> list[int]:
    """Return the Fibonacci numbers from number 0 to number `order`."""
    numbers = [0, 1]
    while len(numbers) <= order:
        numbers.append(numbers[-1] + numbers[-2])
    return numbers[: order + 1]


CHECKS = {"fibonacci_results": FibonacciResults}
