! SPDX-License-Identifier: MIT
!> What values of options can be when their units are known: bounds in SI so wide that rock, soils, masonry, concrete,
!> wood, foam and steel are inside, and so narrow that a value in another unit mostly is not. docs/file-formats.md has
!> the reasons of each.
module rockdda_model_possible_values
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_strings, only : to_string
   use rockdda_model_units, only : unit_system_type
   implicit none
   private
   public :: known_values_type, bounds_of, centrifuge

   !> Earth's gravity, and accelerations above which a model stands in a centrifuge [m/s2].
   real(wp), parameter :: earth = 9.81_wp, centrifuge = 15.0_wp
   !> Friction angles between these are radians, 3 to 90 degrees; smaller ones are next to no friction [deg].
   real(wp), parameter :: radians(2) = [0.05_wp, 0.5_wp*pi]
   !> Plastic strains from here on are in per cent.
   real(wp), parameter :: per_cent = 0.5_wp
   !> Young's modulus over density [m2/s2]: the square of the speed of a wave in a bar, 10 m/s in peat and soft foam.
   real(wp), parameter :: least_speed2 = 100.0_wp
   !> Bounds of the magnitude of a value that is not 0, and those within which most values lie [SI].
   type :: bounds_type
      character(len=20) :: name = ''
      character(len=14) :: dimension = ''
      real(wp) :: least = 0, most = 0
      real(wp) :: usual(2) = 0
      character(len=5) :: group = ''           !! where they hold; '': in all that have no row of their own
   end type bounds_type

   type(bounds_type), parameter :: bounds(*) = [ &
      bounds_type('density', 'mass/length^2', 5.0_wp, 25000.0_wp, [400.0_wp, 9000.0_wp]), &
      bounds_type('young', 'stress', 1.0e4_wp, 1.3e12_wp, [2.0e8_wp, 5.0e11_wp]), &
      bounds_type('unit_weight', 'force/length^2', 50.0_wp, 1.0e8_wp, [4.0e3_wp, 9.0e4_wp]), &
      bounds_type('unit_weight', 'stress/length', 50.0_wp, 3.0e5_wp, [4.0e3_wp, 9.0e4_wp]), &
      bounds_type('gravity', 'length/time^2', 0.05_wp, 5000.0_wp, [9.0_wp, 10.5_wp]), &
      bounds_type('cohesion', 'stress', 100.0_wp, huge(1.0_wp), [1.0e3_wp, 1.0e8_wp]), &
      bounds_type('tension', 'stress', 100.0_wp, huge(1.0_wp), [1.0e3_wp, 1.0e8_wp]), &
      bounds_type('residual_cohesion', 'stress', 100.0_wp, huge(1.0_wp), [1.0e3_wp, 1.0e8_wp]), &
      bounds_type('residual_tension', 'stress', 100.0_wp, huge(1.0_wp), [1.0e3_wp, 1.0e8_wp]), &
      bounds_type('jcs', 'stress', 1.0e5_wp, 2.0e9_wp, [1.0e6_wp, 5.0e8_wp]), &
      bounds_type('normal_stiffness', 'stress/length', 1.0e2_wp, 1.0e16_wp, [1.0e6_wp, 1.0e12_wp]), &
      bounds_type('shear_stiffness', 'stress/length', 1.0e2_wp, 1.0e16_wp, [1.0e5_wp, 1.0e12_wp]), &
      bounds_type('slip_length', 'length', 1.0e-8_wp, 100.0_wp, [1.0e-4_wp, 1.0_wp]), &
      bounds_type('slip_rate', 'length/time', 1.0e-9_wp, 1.0e3_wp, [1.0e-4_wp, 10.0_wp]), &
      bounds_type('stiffness', 'force/length', 1.0e2_wp, 1.0e18_wp, [1.0e7_wp, 1.0e13_wp]), &
      bounds_type('stress', 'stress', 100.0_wp, 2.0e9_wp, [1.0e3_wp, 2.0e8_wp]), &
      bounds_type('traction', 'stress', 100.0_wp, 2.0e9_wp, [1.0e3_wp, 2.0e8_wp]), &
      bounds_type('pressure', 'stress', 100.0_wp, 2.0e9_wp, [1.0e3_wp, 2.0e8_wp]), &
      bounds_type('surcharge', 'stress', 100.0_wp, 2.0e9_wp, [1.0e3_wp, 2.0e8_wp]), &
      bounds_type('stress_gradient', 'stress/length', 50.0_wp, 1.0e8_wp, [4.0e3_wp, 9.0e4_wp]), &
      bounds_type('gradient', 'stress/length', 50.0_wp, 1.0e8_wp, [4.0e3_wp, 9.0e4_wp]), &
      bounds_type('force_start', 'force/length', 0.0_wp, 1.0e12_wp, [1.0e3_wp, 1.0e8_wp]), &
      bounds_type('force_end', 'force/length', 0.0_wp, 1.0e12_wp, [1.0e3_wp, 1.0e8_wp]), &
      bounds_type('velocity', 'length/time', 0.0_wp, 1.0e3_wp, [1.0e-3_wp, 50.0_wp]), &
      bounds_type('thickness', 'length', 5.0e-3_wp, 10.0_wp, [0.03_wp, 3.0_wp], 'liner'), &
      bounds_type('element', 'length', 1.0e-3_wp, 50.0_wp, [0.03_wp, 10.0_wp], 'liner'), &
      bounds_type('young', 'stress', 1.0e6_wp, 1.3e12_wp, [5.0e8_wp, 3.0e11_wp], 'liner'), &
      bounds_type('density', 'mass/length^2', 5.0_wp, 25000.0_wp, [400.0_wp, 9000.0_wp], 'liner'), &
      bounds_type('compressive_strength', 'stress', 1.0e5_wp, 2.0e9_wp, [1.0e6_wp, 2.0e8_wp], 'liner'), &
      bounds_type('tensile_strength', 'stress', 1.0e4_wp, 2.0e9_wp, [1.0e5_wp, 5.0e8_wp], 'liner'), &
      bounds_type('diameter', 'length', 1.0e-3_wp, 0.5_wp, [0.01_wp, 0.2_wp], 'bolt'), &
      bounds_type('area', 'length^2', 1.0e-7_wp, 0.2_wp, [5.0e-5_wp, 0.05_wp], 'bolt'), &
      bounds_type('young', 'stress', 1.0e9_wp, 1.3e12_wp, [5.0e9_wp, 3.0e11_wp], 'bolt'), &
      bounds_type('yield_force', 'force', 100.0_wp, 1.0e9_wp, [2.0e4_wp, 2.0e7_wp], 'bolt'), &
      bounds_type('plate_strength', 'force', 1.0e3_wp, 1.0e9_wp, [2.0e4_wp, 2.0e7_wp], 'bolt'), &
      bounds_type('plateau_force', 'force', 1.0e3_wp, 1.0e9_wp, [2.0e4_wp, 2.0e7_wp], 'bolt'), &
      bounds_type('grout_stiffness', 'stress', 1.0e5_wp, 1.0e13_wp, [1.0e7_wp, 1.0e11_wp], 'bolt'), &
      bounds_type('grout_strength', 'force/length', 1.0e3_wp, 1.0e9_wp, [1.0e4_wp, 1.0e7_wp], 'bolt'), &
      bounds_type('bedding_stiffness', 'stress', 1.0e6_wp, 1.0e13_wp, [5.0e7_wp, 1.0e12_wp], 'bolt'), &
      bounds_type('length', 'length', 0.05_wp, 500.0_wp, [0.5_wp, 100.0_wp], 'bolt'), &
      bounds_type('spacing', 'length', 0.02_wp, 200.0_wp, [0.3_wp, 20.0_wp], 'bolt'), &
      bounds_type('spacing_out_of_plane', 'length', 0.02_wp, 200.0_wp, [0.3_wp, 20.0_wp], 'bolt'), &
      bounds_type('stroke', 'length', 1.0e-4_wp, 10.0_wp, [0.02_wp, 2.0_wp], 'bolt')]

   !> Values that are possible, but in rock below what is usual by a slip of the unit.
   character(len=16), parameter :: not_small(*) = [character(len=16) :: 'gravity', 'density', 'cohesion', 'tension', &
      'normal_stiffness', 'shear_stiffness']
   !> Young's modulus of soils and foam, which no rock has [Pa].
   real(wp), parameter :: soft = 5.0e7_wp

   !> Units in which people give such values, by the size in SI.
   type :: habit_type
      character(len=14) :: dimension = ''
      character(len=34) :: name = ''
      real(wp) :: size = 1
   end type habit_type

   type(habit_type), parameter :: habits(*) = [ &
      habit_type('mass/length^2', 'kg/m3', 1.0_wp), habit_type('mass/length^2', 't/m3', 1.0e3_wp), &
      habit_type('mass/length^2', 't/mm3', 1.0e12_wp), habit_type('mass/length^2', 'kg/mm3', 1.0e9_wp), &
      habit_type('mass/length^2', 'N/m3, a unit weight', 1/earth), &
      habit_type('mass/length^2', 'kN/m3, a unit weight', 1.0e3_wp/earth), &
      habit_type('stress', 'Pa', 1.0_wp), habit_type('stress', 'kPa', 1.0e3_wp), &
      habit_type('stress', 'MPa', 1.0e6_wp), habit_type('stress', 'GPa', 1.0e9_wp), &
      habit_type('force/length^2', 'N/m3', 1.0_wp), habit_type('force/length^2', 'kN/m3', 1.0e3_wp), &
      habit_type('force/length^2', 'MN/m3', 1.0e6_wp), habit_type('force/length^2', 'N/mm3', 1.0e9_wp), &
      habit_type('force/length^2', 'kg/m3, a density', earth), &
      habit_type('stress/length', 'Pa/m (N/m3)', 1.0_wp), habit_type('stress/length', 'kPa/m (kN/m3)', 1.0e3_wp), &
      habit_type('stress/length', 'MPa/m', 1.0e6_wp), habit_type('stress/length', 'N/mm3', 1.0e9_wp), &
      habit_type('stress/length', 'kg/m3, a density', earth), &
      habit_type('length/time^2', 'm/s2', 1.0_wp), habit_type('length/time^2', 'mm/s2', 1.0e-3_wp), &
      habit_type('length/time^2', 'cm/s2', 1.0e-2_wp), habit_type('length/time^2', 'g', earth), &
      habit_type('length', 'm', 1.0_wp), habit_type('length', 'mm', 1.0e-3_wp), &
      habit_type('length', 'cm', 1.0e-2_wp), &
      habit_type('length^2', 'm2', 1.0_wp), habit_type('length^2', 'mm2', 1.0e-6_wp), &
      habit_type('length^2', 'cm2', 1.0e-4_wp), &
      habit_type('force', 'N', 1.0_wp), habit_type('force', 'kN', 1.0e3_wp), habit_type('force', 'MN', 1.0e6_wp), &
      habit_type('length/time', 'm/s', 1.0_wp), habit_type('length/time', 'mm/s', 1.0e-3_wp), &
      habit_type('force/length', 'N/m', 1.0_wp), habit_type('force/length', 'kN/m', 1.0e3_wp), &
      habit_type('force/length', 'MN/m', 1.0e6_wp)]

   !> The system of units, and what was read so far that others are compared with.
   type :: known_values_type
      type(unit_system_type) :: system
      real(wp), private :: gravity = earth              !! [m/s2]
      real(wp), private :: density = 0                  !! of the material, [kg/m3]; 0: not given
   contains
      procedure :: begin_group
      procedure :: problem_of
   end type known_values_type

contains

   !> Forget the material before.
   pure subroutine begin_group(self)
      class(known_values_type), intent(inout) :: self
      self%density = 0
   end subroutine begin_group

   !> The group whose bounds hold for the values of one with this option: a change of a lining has those of linings.
   pure function bounds_of(group, name) result(judged_as)
      character(len=*), intent(in) :: group, name
      character(len=:), allocatable :: judged_as
      judged_as = group
      if (group == 'change' .and. name == 'liner') judged_as = 'liner'
   end function bounds_of

   !> What is wrong with the value of an option: '' or 'cannot be ...', or only unlikely. A force that a table of
   !> factors multiplies (scaled) may be small.
   subroutine problem_of(self, group, name, dimension, value, scaled, text, unlikely)
      class(known_values_type), intent(inout) :: self
      character(len=*), intent(in) :: group, name, dimension
      real(wp), intent(in) :: value                     !! of several numbers the one of the largest magnitude
      logical, intent(in) :: scaled
      character(len=:), allocatable, intent(out) :: text
      logical, intent(out) :: unlikely
      type(bounds_type) :: b
      character(len=:), allocatable :: cause, unit
      real(wp) :: si, ratio
      integer :: i
      text = ''
      unlikely = .false.
      if (.not. self%system%is_known() .or. .not. abs(value) > 0) return
      if (name == 'rupture_strain' .and. value >= per_cent .and. value < huge(1.0_wp)) then
         unlikely = .true.
         text = to_string(value, 4)//' is '//to_string(100*value, 4)//' % of the length, steel breaks at 0.02 '// &
                'to 0.2: it seems to be in per cent, give '//to_string(value/100, 4)
         return
      end if
      unit = dimension
      if (group == 'bolt') then
         ! a force over length and slip, in Pa; the same dimension is that of a weight elsewhere
         if (dimension == 'force/length^2') unit = 'stress'
         ! of a bolt, or of a bolt over 1 mm
         if (index(unit, 'force') == 1 .and. self%system%name == 'mm') return
      end if
      if (dimension == 'deg') then
         call judge_angle(name, value, text)
         return
      end if
      b%name = ''
      do i = 1, size(bounds)
         if (bounds(i)%name /= name .or. bounds(i)%dimension /= unit) cycle
         if (len_trim(bounds(i)%group) == 0 .or. bounds(i)%group == group) b = bounds(i)
      end do
      if (len_trim(b%name) == 0) return
      si = abs(self%system%in_si(value, dimension))
      if (name == 'unit_weight' .and. dimension == 'stress/length') then
         b%dimension = 'force/length^2'
         if (group == 'water') b = bounds_type(name, b%dimension, 5.0e3_wp, 3.0e4_wp, [9.0e3_wp, 1.2e4_wp])
         if (self%gravity > centrifuge) b%most = b%most*self%gravity/earth
      end if
      if (scaled) b%least = 0
      if (name == 'gravity') self%gravity = si
      if (name == 'density') self%density = si
      if (si < b%least .or. si > b%most) then
         cause = cause_text(value, b, self%system)
         ! values that no other unit explains are meant: rigid blocks, models of a laboratory
         if (len(cause) == 0) return
         text = value_text(self%system, value, b%dimension)//' cannot be, '//range_text(self%system, b)//cause
      else if (is_unlikely() .and. len(cause_text(value, b, self%system)) > 0) then
         unlikely = .true.
         text = value_text(self%system, value, b%dimension)//' is unlikely'// &
                trim(merge(' for a lining', '             ', group == 'liner'))//', usual are '// &
                to_string(b%usual(1)/self%system%in_si(1.0_wp, b%dimension), 3)//' to '// &
                to_string(b%usual(2)/self%system%in_si(1.0_wp, b%dimension), 3)//' '// &
                self%system%unit_of(b%dimension)//cause_text(value, b, self%system)
         return
      else if (name == 'young' .and. self%density > 0) then
         ratio = si/self%density
         if (ratio < least_speed2) text = value_text(self%system, value, dimension)// &
            ' cannot be with this density: a wave would run at '//to_string(sqrt(ratio), 2)//' m/s, in soft soils '// &
            'and foam at 10 or more, in rock at 1000 to 6000'//cause_text(value, b, self%system)
      else if (name == 'unit_weight' .and. dimension == 'force/length^2' .and. self%density > 0) then
         ratio = si/self%density
         if (ratio < 0.05_wp .or. ratio > 5000) text = value_text(self%system, value, dimension)//' cannot be with '// &
            'this density: it would be that of a gravity of '//to_string(ratio, 3)//' m/s2, not 9.81'// &
            cause_text(value, b, self%system)
      end if
      if (len(text) > 0) text = text//". (units = 'none' of &model takes any consistent values)"

   contains

      !> Is the value beyond what is usual where that counts?
      pure logical function is_unlikely()
         is_unlikely = any(not_small == name) .and. si < b%usual(1) .and. .not. scaled
         ! what no wave could run through is an error
         if (name == 'young') is_unlikely = si < soft .and. si >= least_speed2*self%density
         if (group == 'liner') is_unlikely = si < b%usual(1) .or. si > b%usual(2)
      end function is_unlikely

   end subroutine problem_of

   !> A friction angle in radians.
   pure subroutine judge_angle(name, value, text)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      character(len=:), allocatable, intent(inout) :: text
      if (name /= 'friction' .and. name /= 'residual_friction') return
      if (value < radians(1) .or. value > radians(2)) return
      text = to_string(value, 6)//' degrees cannot be: it is in radians, give '//to_string(value*180/pi, 4)// &
             " degrees. (units = 'none' of &model takes any value)"
   end subroutine judge_angle

   !> '2.7 kg/m^3'
   pure function value_text(system, value, dimension) result(text)
      type(unit_system_type), intent(in) :: system
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: dimension
      character(len=:), allocatable :: text
      text = to_string(value, 6)//' '//system%unit_of(dimension)
   end function value_text

   !> 'from 5 to 25000 kg/m^3', in the units of the system.
   pure function range_text(system, b) result(text)
      type(unit_system_type), intent(in) :: system
      type(bounds_type), intent(in) :: b
      character(len=:), allocatable :: text
      real(wp) :: unit
      unit = system%in_si(1.0_wp, b%dimension)
      text = 'other than 0 it is at least '//to_string(b%least/unit, 3)
      if (b%most < huge(1.0_wp)) text = 'possible are '//to_string(b%least/unit, 3)//' to '// &
                                        to_string(b%most/unit, 3)
      if (.not. b%least > 0) text = 'possible is up to '//to_string(b%most/unit, 3)
      text = text//' '//system%unit_of(b%dimension)
   end function range_text

   !> The unit that the value seems to be in, that which brings it nearest to the middle of what is usual, of a stress
   !> with the next one (kPa and MPa are both common), and its value in that of the system; '' where none fits.
   pure function cause_text(value, b, system) result(text)
      real(wp), intent(in) :: value
      type(bounds_type), intent(in) :: b
      type(unit_system_type), intent(in) :: system
      character(len=:), allocatable :: text, names, values
      real(wp) :: far(size(habits))
      integer :: i, k
      do i = 1, size(habits)
         far(i) = huge(1.0_wp)
         associate (si => abs(value)*habits(i)%size)
            if (habits(i)%dimension == b%dimension .and. si >= b%usual(1) .and. si <= b%usual(2)) &
               far(i) = abs(log(si**2/product(b%usual)))
         end associate
      end do
      text = ''
      names = ''
      values = ''
      do k = 1, merge(2, 1, b%dimension == 'stress')
         if (.not. any(far < huge(1.0_wp))) exit
         ! of two as far, to rounding, the first
         i = findloc(far <= minval(far)*(1 + 1.0e-9_wp), .true., dim=1)
         far(i) = huge(1.0_wp)
         if (k == 2) names = names//' or '
         if (k == 2) values = values//' or '
         names = names//trim(habits(i)%name)
         values = values//to_string(value*habits(i)%size/system%in_si(1.0_wp, b%dimension), 4)
         text = ': it seems to be in '//names//", but units = '"//trim(system%name)//"' has "// &
                system%unit_of(b%dimension)//', where it is '//values
      end do
   end function cause_text

end module rockdda_model_possible_values
