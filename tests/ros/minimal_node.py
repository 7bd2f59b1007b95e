"""A node of the smallest kind, for the tests of runtime, parameters, health and clients."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from std_msgs.msg import String
from std_srvs.srv import Trigger

from irlpilco_ros.learning.settings import check, declarations, setting
from irlpilco_ros.ros.clients import Clients, ServiceError
from irlpilco_ros.ros.health import OK, WARN, Health
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.runtime import run_node
from irlpilco_ros.ros.suite_node import SuiteNode


@dataclass(frozen=True)
class MinimalSettings:
    gain: float = setting(1.0, "A gain.", unit="rad/s", minimum=0.0, maximum=5.0)
    count: int = setting(3, "A count.", minimum=1)
    mode: str = setting("slow", "A mode.", choices=("slow", "fast"))
    limits: tuple[float, ...] = setting((), "Some limits.", unit="rad", minimum=0.0)
    fixed: bool = setting(False, "Cannot be changed.", read_only=True)
    dawdling: float = setting(1.0, "How long dawdle takes.", unit="s")

    def __post_init__(self) -> None:
        check(self)


class MinimalNode(SuiteNode):
    def __init__(self) -> None:
        super().__init__("minimal", declarations(MinimalSettings))
        self.settings = declare_settings(self, MinimalSettings, apply=self._apply)
        self.health = Health(self)
        self.warnings = 0
        self.clients_of_others = Clients(self)
        self.last_words = self.create_publisher(String, "last_words", 10)
        group = ReentrantCallbackGroup()
        self.create_service(Trigger, "~/settings", self._tell)
        self.create_service(Trigger, "~/is_heard", self._is_heard)
        self.create_service(Trigger, "~/warn", self._warn)
        self.create_service(Trigger, "~/fail", self._fail)
        self.create_service(Trigger, "~/ask", self._ask, callback_group=group)
        self.create_service(Trigger, "~/wait", self._wait, callback_group=group)
        self.create_service(Trigger, "~/dawdle", self._dawdle, callback_group=group)
        self.health.report(OK, "ready", answer=42)

    def shutdown(self) -> None:
        self.last_words.publish(String(data="farewell"))
        self.last_words.wait_for_all_acked(Duration(seconds=0.1))

    def _apply(self, settings: MinimalSettings) -> None:
        self.settings = settings

    def _tell(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, repr(self.settings)
        return response

    def _is_heard(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self.last_words.get_subscription_count() > 0
        return response

    def _warn(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.warnings += 1
        self.health.report(WARN, f"getting warm ({self.warnings})")
        response.success = True
        return response

    def _fail(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        raise RuntimeError("a fault in a callback")

    async def _ask(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Call another node from a callback, set its parameters, and say what came of it."""
        try:
            gain = self.settings.gain
            await self.clients_of_others.set_parameters("other", {"gain": gain}, wait=0.5)
            response.message = await self.clients_of_others.trigger("other/settings", 2.0)
            response.success = True
        except ServiceError as error:
            response.message = str(error)
        return response

    async def _wait(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Ask oneself, who takes longer than one is willing to wait."""
        try:
            await self.clients_of_others.trigger("minimal/dawdle", 0.3)
        except ServiceError as error:
            response.message = str(error)
        return response

    async def _dawdle(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        await self.clients_of_others.sleep(self.settings.dawdling)
        response.success = True
        return response


if __name__ == "__main__":
    sys.exit(run_node(MinimalNode))
