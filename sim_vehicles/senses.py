"""What a vehicle feels: inertial sensors and GPS, faults included, and the estimate of both."""

from hil.damage import Damage
from hil.physics_link import PhysicsState
from hil.scenario import Sensors
from sim_vehicles.estimator import Estimate, Estimator
from sim_vehicles.innovation import Innovation, innovation
from sim_vehicles.sensors import Barometer, Gps, GpsFix, Inertial, InertialSensors, Vector

BLIND_AFTER_S = 0.5  # without a fix for so long, what flies no longer believes its speed
FIX_LOST_AFTER_S = 1.0  # without a fix for so long, telemetry says that there is none


class Senses:
    """Sensors and estimator. `home_m` is where the estimate first stood; None until then."""

    def __init__(
        self, sensors: Sensors, seed: int, sysid: int, barometer: Barometer | None = None
    ) -> None:
        self._noise, self._barometer = sensors, barometer
        self._inertial = InertialSensors(sensors, seed, sysid)
        self._gps = Gps(sensors, seed, sysid)
        self._estimator = Estimator(sensors, barometer is not None)
        self._estimate = self._estimator.estimate()
        self.sample: Inertial | None = None
        self.fix: GpsFix | None = None
        self.innovation = Innovation()
        self.home_m: Vector | None = None

    def feel(self, state: PhysicsState, dt_s: float, damage: Damage) -> bool:
        """Take a state of the physics in. Whether this made the estimate ready."""
        self.sample = self._inertial.sample(state, damage.gyro, damage.accel)
        self._estimator.inertial(self.sample, dt_s)
        if self._barometer is not None:
            down_m = self._barometer.sample(state)
            if dt_s > 0.0:
                self._estimator.barometer(down_m, self.sample, dt_s)
        fix = self._gps.sample(state, damage.gps)
        if fix is not None:
            self.fix = fix
            self.innovation = innovation(fix, self._estimator.estimate(), self._noise)
            self._estimator.gps(fix)
        elif self._estimator.fix_age_s > FIX_LOST_AFTER_S:
            self.fix = None
        self._estimate = self._estimator.estimate()
        if self.home_m is not None or not self._estimator.ready:
            return False
        self.home_m = self._estimate.position_m
        return True

    @property
    def is_blind(self) -> bool:
        """No fix for so long that the speed is not known."""
        return self.home_m is not None and self._estimator.fix_age_s > BLIND_AFTER_S

    def estimate(self) -> Estimate:
        """As it was after the last `feel`."""
        return self._estimate

    @property
    def ready(self) -> bool:
        return self._estimator.ready

    @property
    def fix_age_s(self) -> float | None:
        """None while there is nothing to miss."""
        return self._estimator.fix_age_s if self.home_m else None

    @property
    def home_down_m(self) -> float:
        """Where heights count from, as NED down."""
        return (self.home_m or (0.0, 0.0, 0.0))[2]
