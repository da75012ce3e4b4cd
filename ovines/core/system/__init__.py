"""The mechanical system: scenario, parameters, Host, walls, friction, equations of motion."""
