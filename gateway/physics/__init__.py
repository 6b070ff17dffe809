"""What the regulator knows of the bench and the truck: motor, friction, road load (pure)."""
